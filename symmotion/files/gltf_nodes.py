"""Which node of a glTF file, and which of its animations: trees of nodes, channels by node and property."""

from pathlib import Path

from symmotion.errors import InputError
from symmotion.files.gltf_reading import Items, Place

PATHS = {"translation": 3, "rotation": 4, "scale": 3}

# By node and property, the sampler's entry: only those asked for are read.
Channels = dict[int, dict[str, Place]]


def named(node: Place) -> str:
    name = node.get("name")
    return repr(name.text())[:60] if name is not None else node.way


def listed(nodes: Items, moving: Channels) -> str:
    names = [named(nodes[k]) for k in moving]
    return ", ".join(names[:20]) + (" …" if len(names) > 20 else "") if names else "none"


def chosen(items: Items, which: str | int, what: str, path: Path) -> int:
    """The index of the item of a name or an index."""
    if isinstance(which, str):
        alike = [i for i, item in enumerate(items) if (name := item.get("name")) is not None and name.value == which]
        if len(alike) == 1:
            return alike[0]
        raise InputError(
            f"{path}: {len(alike)} {what}s are called {which!r}: give one's index, 0 to {len(items) - 1}; "
            f"there are {shown(items)}"
        )
    if not len(items):
        raise InputError(f"{path}: holds no {what}s, and so no keyframes")
    if not 0 <= which < len(items):
        raise InputError(f"{path}: {what} {which} does not exist: there are {len(items)}, {shown(items)}")
    return which


def shown(items: Items) -> str:
    """The names of items, or where those without one stand."""
    return ", ".join(named(item) for item in items[:20]) + (" …" if len(items) > 20 else "")


def parents_of(nodes: Items) -> dict[int, int]:
    """The parent of every node that has one; InputError where a node has two or is its own ancestor."""
    above_of = _plainly(nodes.values) or _named(nodes)
    done: set[int] = set()
    for k in range(len(nodes)):
        way: set[int] = set()
        above: int | None = k
        while above is not None and above not in done:
            if above in way:
                raise nodes[k].fault("is its own ancestor")
            way.add(above)
            above = above_of.get(above)
        done |= way
    return above_of


def _plainly(values: list) -> dict[int, int]:
    """The parents as the document's own lists have them, for a tenth of the time; none where a list is at fault."""
    lists = [value.get("children", []) if isinstance(value, dict) else None for value in values]
    if not all(isinstance(children, list) for children in lists):
        return {}
    pairs = [(child, k) for k, children in enumerate(lists) for child in children or []]
    if not all(isinstance(c, float) and c.is_integer() and 0 <= c < len(values) for c, _ in pairs):
        return {}
    found = {int(c): k for c, k in pairs}
    return found if len(found) == len(pairs) else {}


def _named(nodes: Items) -> dict[int, int]:
    """The parents; InputError names the child at fault."""
    above_of: dict[int, int] = {}
    for k, node in enumerate(nodes):
        for child in node.items("children"):
            c = child.whole(0, len(nodes) - 1)
            if c in above_of:
                raise child.fault(f"node {c} has two parents")
            above_of[c] = k
    return above_of


def ancestry(parents: dict[int, int], k: int) -> list[int]:
    """A node and those above it, upwards."""
    chain = [k]
    while (above := parents.get(chain[-1])) is not None:
        chain.append(above)
    return chain


def default_node(nodes: Items, parents: dict[int, int], moving: Channels, path: Path) -> int:
    """The one animated node that all others hang from."""
    if not moving:
        raise InputError(f"{path}: the animation moves no node; translation, rotation or scale of one is needed")
    top = [k for k in ancestry(parents, next(iter(moving))) if k in moving][-1]
    if len(moving) == 1:
        return top
    below, open_ = {top}, [top]
    children: dict[int, list[int]] = {}
    for child, parent in parents.items():
        children.setdefault(parent, []).append(child)
    while open_:
        new = children.get(open_.pop(), [])
        below.update(new)
        open_.extend(new)
    if not moving.keys() <= below:
        raise InputError(f"{path}: several nodes are animated, choose one: {listed(nodes, moving)}")
    return top


def channels_of(nodes: Items, animation: Place) -> Channels:
    samplers = animation.items("samplers")
    found: Channels = {}
    for channel in animation.items("channels"):
        target = channel["target"]
        name, index = target["path"].text(), target.get("node")
        if name in PATHS and index is not None:
            k = index.whole(0, len(nodes) - 1)
            if name in found.setdefault(k, {}):
                raise channel.fault(f"the {name} of node {k} is animated twice")
            found[k][name] = channel["sampler"].of(samplers)
    return found


def animation_of(
    animations: Items, nodes: Items, which: str | int | None, node: int | None, chain: list[int], path: Path
) -> tuple[Place, Channels]:
    """The animation of a name or index, when left out the first that moves the node, any node where it is None."""
    if which is not None:
        chosen_one = animations[chosen(animations, which, "animation", path)]
        return chosen_one, channels_of(nodes, chosen_one)
    if not len(animations):
        raise InputError(f"{path}: holds no animations, and so no keyframes")
    every: Channels = {}
    for animation in animations:
        moving = channels_of(nodes, animation)
        if moving and (node is None or any(k in moving for k in chain)):
            return animation, moving
        every |= moving
    if node is not None and every:
        raise InputError(
            f"{path}: node {named(nodes[node])} does not move in any of the animations {shown(animations)}; animated "
            f"are {listed(nodes, every)}"
        )
    return animations[0], {}

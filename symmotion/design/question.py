"""What the questions have in common: constraints at the door, built into programs, and found to be independent."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.constraints import MotionConstraint, Setting
from symmotion.constraints.keyframed import affine_rates
from symmotion.design.independence import require_independent
from symmotion.design.terms import distinct
from symmotion.energies import Energy
from symmotion.errors import InputError
from symmotion.motions import Affine, AffineMotion, Keyframes, as_keyframes
from symmotion.motions.crowding import close_note, opposite_note, require_apart
from symmotion.motions.rigid import squeezed_note
from symmotion.program import Block, Constraint, DesignT, Multipliers, Program, Target, Targets
from symmotion.splines import check_times, same_times, unified

Kind = TypeVar("Kind")


def as_constraints(constraints: object) -> tuple[MotionConstraint, ...]:
    """The constraints of a program; InputError unless they are a sequence of conditions."""
    if isinstance(constraints, MotionConstraint):
        raise InputError(f"constraints: a list is needed, [{type(constraints).__name__}(…)], for a single one too")
    if isinstance(constraints, str | bytes) or not isinstance(constraints, Iterable):
        raise InputError(f"constraints {constraints!r}: a list of conditions is needed")
    found = tuple(constraints)
    for c in found:
        if not isinstance(c, MotionConstraint):
            raise InputError(
                f"constraint {c!r:.80} is no condition on a motion: JetConstraint(lambda jet: …) makes one"
            )
        if not is_dataclass(c) or "name" not in {f.name for f in fields(c)}:
            raise InputError(f"constraint {type(c).__name__}: a dataclass with a field `name` is needed")
        checks.text(c.name, f"name of the {type(c).__name__}")
    return found


def require_rates(ends: str, end_rates: object, known: Sequence[str] = ("natural", "clamped", "periodic")) -> None:
    """InputError for ends that there are not, and for rates without clamped ends or clamped ends without rates."""
    checks.choice(ends, known, "ends")
    if (ends == "clamped") != (end_rates is not None):
        raise InputError("clamped ends go with end_rates, and end_rates with clamped ends")


def rates_at_ends(
    ends: str, end_rates: object, d: int, known: Sequence[str] = ("natural", "clamped", "periodic")
) -> Affine | None:
    """The rates at clamped ends of an affine motion, None at others; what is amiss with them as in `require_rates`."""
    require_rates(ends, end_rates, known)
    return None if end_rates is None else Affine(*affine_rates(end_rates, d, "end_rates"))


def require_times(times: ArrayLike, wanted: np.ndarray) -> None:
    """InputError for keyframes at other times than a program's, up to rounding."""
    if not same_times(check_times(times), wanted):
        raise InputError("with_keyframes keeps the times; make a new program for other times")


def other_keyframes(keyframes: object, old: Keyframes) -> Keyframes:
    """The affine keyframes that take the place of old ones; InputError in another dimension."""
    keys = as_keyframes(keyframes, what="keyframes")  # pyright: ignore[reportArgumentType] it is found out there
    if keys.dimension != old.dimension:
        raise InputError(f"keyframes in {keys.dimension}D for a program in {old.dimension}D")
    return Keyframes(unified(keys.times, old.times), keys.linear, keys.translation)


def apart_keyframes(keys: object, what: str = "keys") -> Keyframes:
    """The keyframes of a program that meets them; InputError for two closer than a millionth of the median step."""
    found = as_keyframes(keys, what=what)  # pyright: ignore[reportArgumentType] it is found out there
    require_apart(found.times)
    return found


def keyframe_notes(times: np.ndarray, linear: np.ndarray | None = None) -> tuple[str, ...]:
    """What a program says of keyframes that it takes: close ones, linear parts (M, d, d) of opposite orientations."""
    found = (close_note(times), None if linear is None else opposite_note(linear))
    return tuple(note for note in found if note is not None)


def motion_notes(keyframes: Keyframes, motion: AffineMotion) -> tuple[str, ...]:
    """What there is to say of a motion that was found: that it squeezes a body between rigid keyframes."""
    found = squeezed_note(keyframes, motion)
    return () if found is None else (found,)


def require_volume(objective: Energy, keys: Keyframes, which: np.ndarray | None = None) -> None:
    """InputError that names the keyframe where det A has vanished or changed sign, where an energy divides by it.

    which: numbers of those that count, all when left out.
    """
    which = np.arange(len(keys)) if which is None else which
    for weight, energy in objective.parts:
        if weight and energy.divides_by_volume:
            volumes = np.linalg.det(keys.linear)
            wrong = volumes[which] * volumes[which[0]] <= 0
            if wrong.any():
                first, i = which[0], which[np.argmax(wrong)]
                raise InputError(
                    f"keyframe {i} has determinant {volumes[i]:.3g} and keyframe {first} {volumes[first]:.3g}: between "
                    f"them A is singular, where {energy.name} is infinite; leave it out, or mend the keyframe"
                )


def require_start(motion: object, kind: type[Kind], dimension: int) -> Kind:
    """A start of this kind in this dimension; InputError for others."""
    if not isinstance(motion, kind):
        raise InputError(f"start {motion!r:.80}: a motion ({kind.__name__}), a solution or numbers are needed")
    found = getattr(motion, "dimension", dimension)
    if found != dimension:
        raise InputError(f"start {motion!r:.80} is in {found}D: {dimension}D is needed")
    return motion


def assembled(
    start: Mapping[str, np.ndarray],
    terms: Sequence[Block],
    given: Sequence[Constraint],
    constraints: Sequence[MotionConstraint],
    setting: Setting,
    design: DesignT,
    lengths: Mapping[str, slice] | None = None,
    shifts: Mapping[str, np.ndarray] | None = None,
    directions: Mapping[str, slice] | None = None,
) -> Program[DesignT]:
    """The program of a question: the conditions given, and the constraints beside them, which are independent.

    lengths, shifts, directions: as of a `Program`.
    """
    extra = built(constraints, setting, given)
    told = {"lengths": lengths or {}, "shifts": shifts or {}, "directions": directions or {}}
    program = Program(start, tuple(terms), (*given, *extra), design, **told)
    if extra:
        require_independent(program)
    return program


Groups = Sequence[tuple[str, np.ndarray, slice]]


def keyframe_groups(constraints: Sequence[MotionConstraint], setting: Setting, channels: int, d: int) -> Groups:
    """The conditions that affine keyframes are: name, keyframes and coordinates of each group that is not empty.

    What a constraint frees of a keyframe is no condition of its own.
    """
    freed = [c.freed(setting) for c in constraints]
    linear, translation = (set(range(len(setting.times))).difference(*(f[k] for f in freed)) for k in (0, 1))
    size = d * d
    if channels == size:
        translation = linear
    groups = [
        ("keyframes", linear & translation, slice(0, channels)),
        ("keyframes, linear part", linear - translation, slice(0, size)),
        ("keyframes, translation", translation - linear, slice(size, channels)),
    ]
    return [(name, np.array(sorted(which)), part) for name, which, part in groups if which]


def by_keyframe(multipliers: Mapping[str, np.ndarray], groups: Groups, keyframes: Keyframes) -> Multipliers:
    """Multipliers by constraint, those of the groups as one "keyframes" in the keyframes' shape; arrays or `Affine`."""
    m, d = len(keyframes), keyframes.dimension
    shaped, rest = np.zeros((m, d * d + d)), dict(multipliers)
    for name, which, part in groups:
        shaped[which, part] = rest.pop(name)
    return {"keyframes": Affine(shaped[:, : d * d].reshape(m, d, d), shaped[:, d * d :]), **rest}


def targets_of(program: Program, constraints: Sequence[MotionConstraint], setting: Setting) -> list[Target]:
    """Where the constraints of a program, its last ones, have coordinates of the setting's keyframes in their data."""
    found, behind = [], program.constraints[len(program.constraints) - len(constraints) :]
    for asked, made in zip(constraints, behind, strict=True):
        followed = asked.follows(setting)
        if followed is not None:
            numbers, part = followed
            d = setting.linear.shape[-1] if setting.linear is not None else 0
            first = made.parameters[0].first if made.parameters else made.block.data.shape[1]
            found.append(Target(made.name, first - len(range(*part.indices(d * d + d))), numbers, part))
    return found


def keyframe_targets(
    program: Program, groups: Groups, constraints: Sequence[MotionConstraint], setting: Setting
) -> dict[str, Targets]:
    """Where affine keyframes are in the data of a program: last in those of the conditions that they are, and behind.

    groups: of those conditions, as `keyframe_groups` has them.
    """
    assert setting.linear is not None  # of affine keyframes
    places = []
    for name, which, part in groups:
        width = program.constraint(name).block.data.shape[1]
        places.append(Target(name, width - (part.stop - part.start), which, part))
    count, d = setting.linear.shape[:2]
    return {"keyframes": Targets(count, d, (*places, *targets_of(program, constraints, setting)))}


def built(constraints: Sequence[MotionConstraint], setting: Setting, given: Sequence[Constraint]) -> list[Constraint]:
    """The conditions as parts of a program beside those given, each under a name of its own.

    InputError where two give one parameter different numbers.
    """
    taken = {c.name for c in given}
    found = [c.named(distinct(c.name, taken)).build(setting) for c in constraints]
    numbers: dict[str, tuple[str, object]] = {}
    for c in found:
        for place in c.parameters:
            value = c.block.data[0, place.columns].tolist(), place.shape
            name, first = numbers.setdefault(place.name, (c.name, value))
            if first != value:
                raise InputError(
                    f"parameter {place.name!r} has other numbers in {c.name!r} than in {name!r}: "
                    "one name is one parameter"
                )
    return found

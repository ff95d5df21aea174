"""USD in ASCII (.usda), as far as prims and what they are placed by go."""

import re
from dataclasses import dataclass, field
from functools import partial
from typing import NoReturn

import numpy as np

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.files.usd_ops import INVERT, RESET, WIDTHS, Operation, Samples, kind_of, local
from symmotion.files.usd_scene import Prim, Scene
from symmotion.files.usd_skel import PARTS, joint_prims
from symmotion.opening import readable

# Each matches a place in one way only, so that what does not match is soon told.
NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
SPACE = r"(?:[\s;]|\#[^\n]*\n)*"
BLANK = re.compile(SPACE)
LONG = r'"""(?:\\.|[^\\])*?"""|\'\'\'(?:\\.|[^\\])*?\'\'\''
STRING = LONG + r'|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|@@@.*?@@@|@[^@\n]*@'
PRIM = re.compile(rf'(def|over|class)\b{SPACE}([A-Za-z_]\w*)?{SPACE}"([^"\n]*)"')
VARIANTS = re.compile(rf'variantSet{SPACE}"[^"\n]*"{SPACE}=')
ORDER = re.compile(rf"reorder{SPACE}\w+{SPACE}=")
PROPERTY = re.compile(
    rf"(?:(?:custom|uniform|varying|config|prepend|append|add|delete|reorder)\b{SPACE})*[\w:]+(?:\[\])?{SPACE}([\w:.]+)"
)
ENTRY = re.compile(rf"(\w+){SPACE}={SPACE}(?:({NUMBER})|({STRING}))")
ARCS = re.compile(r"\b(references|payload|inherits|specializes|subLayers|clips)\s*=")
SPECIAL = re.compile(rf"(?:{STRING})|\#[^\n]*|[\[\](){{}}]", re.DOTALL)
TEXT = re.compile(STRING, re.DOTALL)
PLAIN = re.compile(r"[^\s,;()\[\]{}=]+")
BETWEEN = re.compile(r"[\[\]();,]")
PAIRS = {"(": ")", "[": "]", "{": "}"}
INACTIVE = re.compile(r"\bactive\s*=\s*(?:false|0)\b")
# The prim whose animation places the joints of a skeleton, its own or of a prim above it.
SOURCE = "skel:animationSource"
RATE, METRES = 24.0, 0.01  # what USD takes where a scene does not say


class Composed(InputError):
    """A scene that is put together of several, which Pixar's library reads."""


def read_usd_text(path: FilePath) -> Scene:
    """The scene of a .usda file; `Composed` where it has references, payloads, variants or layers below it."""
    with readable(path) as handle:
        text = handle.read()
    if not text.startswith("#usda 1"):
        raise InputError(f"{path}, line 1: '#usda 1.0' is needed, with which USD in ASCII begins")
    return _Reader(path, text).scene()


@dataclass
class _Open:
    """A prim whose braces are not closed: where it is among the prims, −1 of what is not in the scene; its attributes.

    kind: its type, empty where it has none; attributes: by name, where the value stands and the value as it stands.
    """

    path: str
    index: int
    above: int
    kind: str = ""
    attributes: dict[str, tuple[int, str]] = field(default_factory=dict)


class _Reader:
    """A text and how far it is read."""

    def __init__(self, path: FilePath, text: str):
        self.path, self.text = path, text if text.endswith("\n") else text + "\n"
        self.at = self.text.index("\n") + 1
        self.prims: list[Prim] = []
        self.open: list[_Open] = []
        self.skeletons: list[_Open] = []
        self.animations: dict[str, _Open] = {}
        self.sources: dict[str, str] = {}

    def fail(self, message: str, at: int | None = None) -> NoReturn:
        raise InputError(f"{self.path}, line {self.text.count(chr(10), 0, at or self.at) + 1}: {message}")

    def ahead(self) -> str:
        """The next character that is no space and in no comment; an empty text at the end."""
        found = BLANK.match(self.text, self.at)
        self.at = found.end() if found else self.at
        return self.text[self.at : self.at + 1]

    def taken(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        self.ahead()
        found = pattern.match(self.text, self.at)
        self.at = found.end() if found else self.at
        return found

    def near(self) -> str:
        """What stands here, for messages."""
        return self.text[self.at : self.at + 20].partition("\n")[0]

    def value(self) -> str:
        """A value as it stands, from bracket to bracket."""
        opening = self.ahead()
        begin = self.at
        if opening not in PAIRS:
            if self.taken(TEXT) or self.taken(PLAIN):
                return self.text[begin : self.at]
            self.fail(f"{self.near()!r} where a value is needed")
        open_: list[str] = []
        for found in SPECIAL.finditer(self.text, begin):
            word = found.group()
            if word in PAIRS:
                open_.append(word)
            elif word in ")]}":
                if PAIRS[open_.pop()] != word:
                    self.fail(f"a {word} closes another bracket", found.start())
                if not open_:
                    self.at = found.end()
                    return self.text[begin : self.at]
        self.fail(f"a {opening} is never closed")

    def composes(self, metadata: str) -> None:
        """Raise `Composed` where the metadata of a prim or a layer bring in others."""
        plain = SPECIAL.sub(lambda m: " " if m.group()[0] in "\"'@#" else m.group(), metadata)
        depth, outer = 0, []
        for part in re.split(r"([{}])", plain):  # dictionaries hold names of the user's own
            depth += (part == "{") - (part == "}")
            outer.append(part if depth == 0 else "")
        arc = ARCS.search("".join(outer))
        if arc is not None:
            self.compose(arc.group(1))

    def compose(self, what: str) -> NoReturn:
        raise Composed(f"{self.path}: has {what}, which takes Pixar's library: pip install 'symmotion[usd]'")

    def scene(self) -> Scene:
        layer: dict[str, float | str] = {}
        if self.ahead() == "(":
            metadata = self.value()
            self.composes(metadata)
            layer = {name: float(number) if number else text[1:-1] for name, number, text in ENTRY.findall(metadata)}
        while (character := self.ahead()) or self.open:
            if not character:
                self.fail(f"prim {self.open[-1].path} is never closed")
            if character == "}" and self.open:
                self.at += 1
                self.close()
            elif (found := self.taken(PRIM)) is not None:
                self.begin(*found.groups())
            elif not self.open:
                self.fail(f"{self.near()!r} where a prim is needed")
            else:
                self.statement(self.open[-1])
        unit = layer.get("metersPerUnit", METRES)
        rate = layer.get("timeCodesPerSecond", layer.get("framesPerSecond", RATE))
        if not (isinstance(rate, float) and rate > 0 and isinstance(unit, float) and unit > 0):
            raise InputError(f"{self.path}: timeCodesPerSecond and metersPerUnit: positive numbers are needed")
        for skeleton in self.skeletons:
            self.prims += self.joints(skeleton)
        return Scene(self.prims, rate, str(layer.get("upAxis", "Y")), unit)

    def begin(self, specifier: str, kind: str | None, name: str) -> None:
        """A prim from its name to its opening brace."""
        outer = self.open[-1] if self.open else _Open("", -1, -1)
        there = specifier == "def" and (outer.index >= 0 or not self.open)
        if self.ahead() == "(":
            metadata = self.value()
            self.composes(metadata)
            there = there and INACTIVE.search(metadata) is None
        if self.ahead() != "{":
            self.fail("{ is needed, which opens a prim")
        self.at += 1
        self.open.append(_Open(f"{outer.path}/{name}", len(self.prims) if there else -1, outer.index, kind or ""))
        if there:
            self.prims.append(STILL)  # until it is closed

    def statement(self, prim: _Open) -> None:
        """An attribute, or what prims have beside."""
        if self.taken(VARIANTS):
            self.compose("variants")
        if self.taken(ORDER):
            self.value()
            return
        found = self.taken(PROPERTY)
        if found is None:
            self.fail(f"{self.near()!r} where an attribute or a prim is needed")
        if self.ahead() == "=":
            self.at += 1
            self.ahead()
            begin, name = self.at, found.group(1)
            value = self.value()
            told = name.startswith("xformOp") or prim.kind in ("Skeleton", "SkelAnimation") or name == SOURCE
            if told and prim.index >= 0:
                prim.attributes[name] = begin, value
        if self.ahead() == "(":
            self.value()

    def close(self) -> None:
        """The prim that ends here, placed by its operations."""
        prim = self.open.pop()
        if prim.index < 0:
            return
        if prim.kind == "Skeleton":
            self.skeletons.append(prim)
        if prim.kind == "SkelAnimation":
            self.animations[prim.path] = prim
        if SOURCE in prim.attributes:
            self.sources[prim.path] = prim.attributes[SOURCE][1].strip("[]<> ")
        _, order = prim.attributes.get("xformOpOrder", (0, "[]"))
        names = [text[1:-1] for text in TEXT.findall(order)]
        reset = RESET in names
        names = names[names.index(RESET) + 1 :] if reset else names
        operations = [self.operation(prim, name) for name in names]
        codes = np.unique(np.concatenate([np.zeros(0), *(o.samples.codes for o in operations)]))
        self.prims[prim.index] = Prim(
            prim.path, prim.above, codes, reset, partial(local, self.path, prim.path, operations)
        )

    def operation(self, prim: _Open, name: str) -> Operation:
        kind, attribute = kind_of(name), name.removeprefix(INVERT)
        if kind is None:
            raise InputError(f"{self.path}, prim {prim.path}: the operation {name!r:.60} is unknown")
        number = rf"{NUMBER}{SPACE}"
        width = WIDTHS[kind]
        row = rf"\({SPACE}(?:{number},{SPACE}){{{min(width, 4) - 1}}}{number},?{SPACE}\){SPACE}"
        shape = number if width == 1 else row if width < 16 else rf"\({SPACE}(?:{row},{SPACE}){{3}}{row},?{SPACE}\)"
        if f"{attribute}.timeSamples" in prim.attributes:
            found = self.entries(
                *prim.attributes[f"{attribute}.timeSamples"], rf"{SPACE}({number}):{SPACE}({shape}){SPACE}(,|\}})"
            )
            codes = np.array([float(code) for code, _ in found])
            if not len(codes) or (np.diff(codes) <= 0).any():
                raise InputError(f"{self.path}, prim {prim.path}: the time codes of {attribute} must increase")
            return Operation(kind, Samples(codes, np.array([value for _, value in found])), name != attribute)
        begin, text = prim.attributes.get(attribute, (0, ""))
        if re.fullmatch(shape, text) is None:
            self.fail(f"{attribute} of {prim.path} is {text[:40]!r}: {width} numbers are needed", begin or None)
        return Operation(kind, Samples(np.zeros(0), _numbers(text)[None]), name != attribute)

    def joints(self, skeleton: _Open) -> list[Prim]:
        """The joints of a skeleton as prims; none of one that no animation moves."""
        bound = skeleton.path
        while bound and bound not in self.sources:
            bound = bound.rpartition("/")[0]
        source = self.animations.get(self.sources.get(bound, ""))
        if source is None:
            return []
        parts = {part: found for part in PARTS if (found := self.arrays(source, part)) is not None}
        rest = self.arrays(skeleton, "restTransforms")
        names, animated = (
            [text[1:-1] for text in TEXT.findall(prim.attributes.get("joints", (0, ""))[1])]
            for prim in (skeleton, source)
        )
        place, matrices = (skeleton.index, len(self.prims)), None if rest is None else rest.values.reshape(-1, 16)
        return joint_prims(self.path, skeleton.path, place, names, matrices, animated, parts)

    def arrays(self, prim: _Open, name: str) -> Samples | None:
        """The numbers (K, …) of an array at its time codes (K,), of one without samples (1, …) at none."""
        array = rf"\[(?:[-+\d.,;()eE\s]|\#[^\n]*\n)*\]{SPACE}"
        if f"{name}.timeSamples" in prim.attributes:
            begin, text = prim.attributes[f"{name}.timeSamples"]
            found = self.entries(begin, text, rf"{SPACE}({NUMBER}){SPACE}:{SPACE}({array}){SPACE}(,|\}})")
            codes, values = [float(code) for code, _ in found], [numbers for _, numbers in found]
            if not codes or (np.diff(codes) <= 0).any() or len(set(map(len, values))) > 1:
                raise InputError(
                    f"{self.path}, prim {prim.path}: the time codes of {name} must increase, its arrays be of one size"
                )
            return Samples(np.array(codes), np.array(values))
        begin, text = prim.attributes.get(name, (0, "None"))
        if text == "None":
            return None
        if re.fullmatch(array, text) is None:
            self.fail(f"{name} of {prim.path} is {text[:40]!r}: numbers in brackets are needed", begin or None)
        return Samples(np.zeros(0), self.numbers(text, begin)[None])

    def numbers(self, text: str, begin: int) -> np.ndarray:
        """The numbers of a value that stands at a place."""
        try:
            return _numbers(text)
        except ValueError:
            self.fail(f"{text[:40]!r} where numbers are needed", begin)

    def entries(self, begin: int, text: str, entry: str) -> list[tuple[str, np.ndarray]]:
        """The time samples of a value that stands at a place, code and numbers."""
        pattern, at, found = re.compile(entry), 1, []
        while (sample := pattern.match(text, at)) is not None:
            found.append((sample.group(1), self.numbers(sample.group(2), begin + sample.start(2))))
            at = sample.end()
            if sample.group(3) == "}":
                return found
        if re.fullmatch(rf"{SPACE}\}}", text[at:]) is None:
            place = BLANK.match(text, at)
            at = place.end() if place else at
            self.fail(f"{text[at : at + 40]!r} where a time sample is needed, code: numbers", begin + at)
        return found


def _numbers(text: str) -> np.ndarray:
    """The numbers of a value; ValueError where there are others."""
    text = re.sub(r"\#[^\n]*", "", text) if "#" in text else text
    return np.array(BETWEEN.sub(" ", text).split(), dtype=float)


STILL = Prim("", -1, np.zeros(0), False, partial(local, "", "", []))

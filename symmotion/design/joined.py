"""Several bodies in one program: each keeps its design, and constraints couple them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Protocol, runtime_checkable

import numpy as np

from symmotion.brief import in_a_line
from symmotion.constraints import JetConstraint, MotionConstraint, Setting
from symmotion.constraints.along import Along
from symmotion.design.question import as_constraints, assembled
from symmotion.errors import InputError
from symmotion.jets.space import JetSpace, Places
from symmotion.program import Block, Constraint, Integrated, Multipliers, Program, Quadrature, Targeted, Targets
from symmotion.program.program import Telling
from symmotion.program.state import made_of


@runtime_checkable
class Spaced(Protocol):
    """A design whose motion has jets."""

    @property
    def setting(self) -> Setting: ...


def join(programs: Mapping[str, Program], constraints: Sequence[MotionConstraint] = ()) -> "Program[JoinedDesign]":
    """Several bodies in one program: the sum of the objectives, all the conditions, and constraints that couple them.

    programs: by name of the body, two or more, of any kind. constraints: `JetConstraint`s whose function takes a jet
    of each body, in the order of `programs`: at a time, or times, that is the same for all, or at tuples of times.
    Unknowns, terms, conditions and parameters of a body keep their names behind the body's: "arm: keyframes";
    parameters of the coupling constraints theirs. `solution.motions` has the motions by body.

        join({"arm": arm, "hand": hand}, [JetConstraint(lambda a, b: a.place(tip) - b.place([0, 0, 0]), name="hinge")])

    Raises InputError for what are no programs, names that repeat, and constraints that couple other bodies.

    >>> keys = sm.examples.spatial_keyframes()
    >>> one = sm.affine_program(keys, objective=sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(3)))
    >>> meet = sm.JetConstraint(lambda a, b: a.dv - b.dv, at=[0.5], name="same velocity")
    >>> sorted(sm.ExactNewton().solve(sm.join({"a": one, "b": one}, [meet])).require().motions)
    ['a', 'b']
    """
    began = perf_counter()
    if not isinstance(programs, Mapping) or len(programs) < 2:
        raise InputError("programs: a mapping of two names or more to programs is needed")
    for name, program in programs.items():
        if not isinstance(name, str) or not name:
            raise InputError(f"programs, name {name!r} of a body: a text is needed")
        if not isinstance(program, Program) or not isinstance(program.design, Spaced):
            raise InputError(f"programs, {name!r}: a program of a motion is needed, not a {type(program).__name__}")
    asked = as_constraints(constraints)
    coupling = tuple(c for c in asked if isinstance(c, JetConstraint))
    for c in asked:
        if not isinstance(c, JetConstraint):
            raise InputError(f"constraint {c.name!r} is about one body: give it to that body's program")
    design = JoinedDesign(dict(programs), coupling)
    return replace(design.program(), build_seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class JoinedDesign:
    """The question of several bodies: the program of each, and what couples them.

    programs: by body; constraints: those that couple them. Raises InputError for starts and keyframes that are not
    told by body.

    >>> one = sm.affine_program(sm.examples.planar_keyframes())
    >>> list(sm.join({"left": one, "right": one}).design.programs)
    ['left', 'right']
    """

    programs: dict[str, Program]
    constraints: tuple[JetConstraint, ...]

    __repr__ = in_a_line

    def __getstate__(self) -> dict[str, object]:
        # Only here it is known of which kinds the jets are that a coupling function takes.
        jets = [setting.space.symbols(k) for k, setting in enumerate(self._settings)]
        return {**made_of(self), "constraints": tuple(c.written_for(*jets) for c in self.constraints)}

    @property
    def notes(self) -> tuple[str, ...]:
        """What the bodies' programs say before solving, each after the body's name."""
        return tuple(f"{body}: {note}" for body, p in self.programs.items() for note in p.notes)

    def told(self, motion: Mapping[str, Any]) -> tuple[str, ...]:  # Any: the bodies' kinds differ
        """What is said of the motions found, by body: each after the body's name."""
        return tuple(
            f"{body}: {note}"
            for body, p in self.programs.items()
            if isinstance(p.design, Telling)
            for note in p.design.told(motion[body])
        )

    @property
    def _settings(self) -> list[Setting]:
        return [p.design.setting for p in self.programs.values() if isinstance(p.design, Spaced)]

    def program(self) -> "Program[JoinedDesign]":
        """The program of this question."""
        start = {_of(body, k): v for body, p in self.programs.items() for k, v in p.start.items()}
        terms = tuple(_renamed(b, body) for body, p in self.programs.items() for b in p.terms)
        given = [_renamed_constraint(c, body) for body, p in self.programs.items() for c in p.constraints]
        plain = Program(start, terms, tuple(given), self)
        places = Places(plain.unknowns, {name: plain.place(name) for name in start})
        settings = self._settings
        spaces = tuple(_placed(s.space, body) for s, body in zip(settings, self.programs, strict=True))
        common = Setting(
            spaces, np.empty(0), moves=all(s.moves for s in settings), places=places, bodies=tuple(self.programs)
        )
        lengths = {_of(body, k): v for body, p in self.programs.items() for k, v in p.lengths.items()}
        shifts = {_of(body, k): v for body, p in self.programs.items() for k, v in p.shifts.items()}
        directions = {_of(body, k): v for body, p in self.programs.items() for k, v in p.directions.items()}
        return assembled(start, terms, given, self.constraints, common, self, lengths, shifts, directions)

    # Any: the bodies' kinds differ.
    def motion(self, unknowns: Mapping[str, np.ndarray]) -> dict[str, Any]:
        """The motions by body."""
        return {
            body: p.design.motion({k: unknowns[_of(body, k)] for k in p.start}) for body, p in self.programs.items()
        }

    def unknowns(self, motion: Mapping[str, object]) -> dict[str, np.ndarray]:
        """The unknowns of motions by body."""
        if not isinstance(motion, Mapping) or set(motion) != set(self.programs):
            raise InputError(f"a start for several bodies: motions by name, {', '.join(self.programs)}, are needed")
        found = {body: p.design.unknowns(motion[body]) for body, p in self.programs.items()}
        return {_of(body, k): v for body, values in found.items() for k, v in values.items()}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint, those of a body behind its name, as its own program shows them."""
        rest, shown = dict(multipliers), {}
        for body, p in self.programs.items():
            own = {c.name: rest.pop(_of(body, c.name)) for c in p.constraints}
            shown |= {_of(body, k): v for k, v in p.design.multipliers(own).items()}
        return {**shown, **rest}

    def targets(self, program: Program) -> dict[str, Targets]:
        """Where the bodies' keyframes are in the program's data, by name behind the body's."""
        found = {}
        for body, p in self.programs.items():
            for name, own in p.design.targets(p).items() if isinstance(p.design, Targeted) else ():
                places = tuple(replace(t, block=_of(body, t.block)) for t in own.places)
                found[_of(body, name)] = replace(own, places=places)
        return found

    def _bodies(self, program: Program, x: np.ndarray) -> dict[str, tuple[Program, np.ndarray]]:
        """By body, of those whose terms are integrals, its own program and its share of x."""
        every = program.unpack(x)
        return {
            body: (p, p.pack({k: every[_of(body, k)] for k in p.start}))
            for body, p in self.programs.items()
            if isinstance(p.design, Integrated)
        }

    def quadratures(self, program: Program, x: np.ndarray) -> dict[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        found = {body: p.design.quadratures(p, own) for body, (p, own) in self._bodies(program, x).items()}
        return {_of(body, name): q for body, terms in found.items() for name, q in terms.items()}

    def refined(self, program: "Program[JoinedDesign]", x: np.ndarray) -> "Program[JoinedDesign] | None":
        """The program with the nodes that ten digits need at x (unknowns,); None where it has them, or can have."""
        own = {body: p.design.refined(p, x) for body, (p, x) in self._bodies(program, x).items()}
        finer = {body: p for body, p in own.items() if p is not None}
        if not finer:
            return None
        return replace(self, programs={**self.programs, **finer}).program().with_parameters(**program.parameters)

    def with_keyframes(
        self, program: "Program[JoinedDesign]", keyframes: Mapping[str, object]
    ) -> "Program[JoinedDesign]":
        """The program for other keyframes of some bodies, by name."""
        if not isinstance(keyframes, Mapping) or not set(keyframes) <= set(self.programs):
            raise InputError(f"keyframes by body are needed; there are {', '.join(self.programs)}")
        moved = {
            body: p.with_keyframes(keyframes[body]) if body in keyframes else p for body, p in self.programs.items()
        }
        return replace(self, programs=moved).program()


def _of(body: str, name: str) -> str:
    return f"{body}: {name}"


def _renamed(block: Block, body: str) -> Block:
    """A body's block under the joined names."""
    return replace(block, name=_of(body, block.name), variable=_of(body, block.variable))


def _renamed_constraint(constraint: Constraint, body: str) -> Constraint:
    parameters = tuple(replace(p, name=_of(body, p.name)) for p in constraint.parameters)
    along = constraint.everywhere
    if isinstance(along, Along):
        setting = along.setting
        spaces = tuple(_placed(space, body) for space in setting.spaces)
        along = replace(along, setting=replace(setting, spaces=spaces, bodies=(body,)))
    return replace(constraint, block=_renamed(constraint.block, body), parameters=parameters, everywhere=along)


def _placed(space: JetSpace, body: str) -> JetSpace:
    """A body's space with the name of its unknowns in the joined program."""
    return replace(space, variable=_of(body, space.variable))  # pyright: ignore[reportArgumentType] all are dataclasses

"""Programs that are alike but for their data: what one derived from its structure serves the others."""

from dataclasses import replace

from symmotion.batches.fingerprint import structure_fingerprint
from symmotion.program import Program

KINDS = 8  # structures remembered at a time


class Kin:
    """Programs met one after the other, by structure. For one thread.

    Programs made anew for keyframes at the same times have the same kernels and tables; deriving the null-space
    basis and the patterns from these takes as long as a small solve.
    """

    def __init__(self):
        self._first: dict[str, Program | None] = {}

    def adopt(self, program: Program) -> Program:
        """The program, with the structure of an equal one met before; its answer is the same bit for bit."""
        if program.structure:  # made by `with_keyframes`, or solved before
            return program
        name = structure_fingerprint(program)
        if name not in self._first:
            if len(self._first) >= KINDS:
                self._first.clear()
            self._first[name] = program if _shareable(program) else None
        first = self._first[name]
        if first is None or first is program:
            return program
        return replace(
            program,
            terms=tuple(a.with_data(b.data) for a, b in zip(first.terms, program.terms, strict=True)),
            constraints=tuple(
                replace(c, block=a.block.with_data(c.block.data))
                for a, c in zip(first.constraints, program.constraints, strict=True)
            ),
            structure=first.structure,
        )


def _shareable(program: Program) -> bool:
    """Whether nothing that is derived from the structure depends on the data: the Jacobian of linear conditions may."""
    return not program.linear or not any(c.block.kernel.bilinear for c in program.constraints)

"""What symmotion raises: wrong input at the door, and unsolved programs when the caller insists."""

LONGEST = 2000  # characters of a message
END = 500  # of them at the end, where the remedy stands


def plain(text: object) -> str:
    """A text as a terminal may show it: in one line, its control characters escaped, at most 2,000 characters long.

    What files contain, and what they are called, gets into messages: an escape sequence must not get on from there.
    """
    line = str(text)
    if len(line) > 2 * LONGEST:  # before the work is proportional to it
        line = line[:LONGEST] + line[-LONGEST:]
    if not line.isprintable():
        line = "".join(c if c.isprintable() else _escaped(c) for c in line)
    return line if len(line) <= LONGEST else f"{line[: LONGEST - END - 3]} … {line[-END:]}"


def _escaped(character: str) -> str:
    return " " if character in "\t\n\r" else character.encode("unicode_escape").decode("ascii")


class InputError(ValueError):
    """Input that cannot be used; the message names the culprit and the remedy, see `plain`.

    >>> try:
    ...     sm.Rigidity(3)
    ... except sm.InputError as error:
    ...     print(error)
    rigidity of order 3: 1 (HJK 10) or 2 (HJK 11) is needed
    """

    def __init__(self, message: object = ""):
        super().__init__(plain(message))


class SolveError(RuntimeError):
    """Raised by `Solution.require`: the program was not solved to the tolerance asked for.

    message: the reason, of the certificate or of the solver.

    >>> try:
    ...     sm.ExactNewton(max_iterations=1).solve(sm.affine_program(sm.examples.planar_keyframes())).require()
    ... except sm.SolveError as error:
    ...     print("iteration-limit" in str(error))
    True
    """

    def __init__(self, message: object = ""):
        super().__init__(plain(message))

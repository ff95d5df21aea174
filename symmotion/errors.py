"""What symmotion raises: wrong input at the door, and unsolved programs when the caller insists."""


class InputError(ValueError):
    """Input that cannot be used; the message names the culprit and the remedy."""


class SolveError(RuntimeError):
    """Raised by `Solution.require`: the program was not solved to the tolerance asked for."""

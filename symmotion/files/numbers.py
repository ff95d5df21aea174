"""Numbers in text files."""

from math import isfinite

from symmotion.errors import InputError


def finite(word: str) -> float:
    """The number that a word is, as C and Fortran write it; InputError, without the place, for any other word.

    What Python alone takes for numbers, digits in groups (1_000) or of other scripts, is a slip in a file.
    """
    try:
        number = float(word) if word.strip().isascii() and "_" not in word else None
    except ValueError:
        number = None
    if number is None or not isfinite(number):
        raise InputError(f"{word[:40]!r} is not {'a number' if number is None else 'finite'}")
    return number

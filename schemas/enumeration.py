"""Names, words and numbers of things in a sentence."""

from __future__ import annotations

from collections.abc import Sequence


def listed(names: Sequence[str]) -> str:
    """Return at least one name as words: a, b and c."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def as_words(name: str) -> str:
    """Return a name of the code as words.

    Examples
    --------
    >>> as_words("yaw_rate")
    'yaw rate'
    """
    return name.replace("_", " ")


def first_of(names: Sequence[str], most: int) -> str:
    """Return the first of some names as words, and that there are more.

    Examples
    --------
    >>> first_of(["HEHDT", "AGRSA", "IIVHW"], 2)
    'HEHDT, AGRSA ...'
    """
    return ", ".join(names[:most]) + (" ..." if len(names) > most else "")


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, which takes an s where they are several or none.

    Examples
    --------
    >>> counted(1, "zigzag"), counted(2, "zigzag"), counted(0, "zigzag")
    ('1 zigzag', '2 zigzags', '0 zigzags')
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def at_the_beginning(words: str) -> str:
    """Return words as a sentence begins with them; what stands behind their first letter stays.

    Examples
    --------
    >>> at_the_beginning("lever arm of the GNSS antenna")
    'Lever arm of the GNSS antenna'
    """
    return words[:1].upper() + words[1:]

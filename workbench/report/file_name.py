"""What the file of a report is called."""

from __future__ import annotations

import re

#: Letters of a vessel's name that stand in a file's name as they are.
_PLAIN = re.compile(r"[^\w .-]")


def called_after(vessel: str) -> str:
    r"""Return a file name that is made of a vessel's name, whatever she is called.

    Examples
    --------
    >>> called_after("Aurora 2"), called_after("../a\0b")
    ('Aurora 2.html', '_.._a_b.html')
    """
    plain = _PLAIN.sub("_", vessel)[:80]
    # neither hidden nor an option to other programs
    return ("_" if plain.startswith((".", "-")) else "") + f"{plain}.html"

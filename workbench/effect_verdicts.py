"""What a diagnosis says of one effect, in words: the JSON has one value for all that is not claimed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_WORDS = {"not_testable": "not testable", "negligible": "too small to matter"}
#: what ``absent`` is, by the beginning of its reason
_ABSENT = {"not seen": "not seen", "no longer significant": "not needed"}


def effect_verdict(candidate: Mapping[str, Any], outcome: str) -> str:
    """Return the verdict on an effect in words.

    Parameters
    ----------
    candidate : mapping
        One of the ``candidates`` of a diagnosis.
    outcome : str
        The verdict of the diagnosis.

    Examples
    --------
    >>> effect_verdict({"verdict": "absent", "why": "not seen; upper limit (95 %): |c| < 0.1"}, "explained")
    'not seen'
    >>> effect_verdict({"verdict": "absent", "why": "no longer significant once rudder lag is included"}, "explained")
    'not needed'
    >>> effect_verdict({"verdict": "absent", "why": "significant by itself"}, "insufficient_data")
    'not judged'
    """
    verdict, why = str(candidate["verdict"]), str(candidate["why"])
    if verdict != "absent":
        return _WORDS.get(verdict, verdict)
    found = next((words for beginning, words in _ABSENT.items() if why.startswith(beginning)), None)
    return found or ("not judged" if outcome == "insufficient_data" else "not confirmed")

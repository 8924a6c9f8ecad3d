"""NMEA 0183 sentences inside the text of messages, such as std_msgs/String and nmea_msgs/Sentence: found, not read."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import reduce
from operator import xor

#: A sentence with its checksum.
_SENTENCE = re.compile(rb"[$!]([A-Z]{2}[A-Z0-9]{3},[\x20-\x23\x25-\x29\x2b-\x7e]{0,90})\*([0-9A-Fa-f]{2})")

#: What to do about them.
NEXT_STEP = (
    "Write the sentences to a text file, one a line, each behind the time at which it was logged (ISO 8601, or the "
    "seconds since 1970) and a blank, and ingest that: NMEA logs need no profile."
)


def holds_sentence(payload: bytes) -> bool:
    """Return whether a message holds a sentence with the right checksum, however the message is encoded.

    Examples
    --------
    >>> holds_sentence(b'{"data": "$HEHDT,20.00,T*2D"}'), holds_sentence(b'{"data": "$HEHDT,20.01,T*2D"}')
    (True, False)
    """
    return any(reduce(xor, found[1]) == int(found[2], 16) for found in _SENTENCE.finditer(payload))


def about(topics: Collection[str]) -> str:
    """Return the sentence that says which topics hold sentences."""
    many = len(topics) > 1
    return (
        f"Topic{'s' if many else ''} {', '.join(sorted(topics))} hold{'' if many else 's'} NMEA 0183 sentences, which "
        "are not read inside MCAP."
    )

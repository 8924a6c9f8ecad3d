"""The names of the joints in a message of sensor_msgs/JointState: which element of its lists is the rudder.

References
----------
sensor_msgs/msg/JointState: a header of a stamp (int32, uint32) and a string, then the names, as many as elements in
each of the lists behind them. OMG, DDS-XTypes 1.3, 7.4.1: plain CDR version 1.
"""

from __future__ import annotations

import struct

#: Bytes of the encapsulation, and of the stamp.
_ENCAPSULATION, _STAMP = 4, 8

_LONGEST = 64


def joint_names(message: bytes) -> list[str]:
    r"""Return the names in a message in CDR; none where it is damaged.

    Examples
    --------
    >>> joint_names(b"\0\1\0\0" + bytes(8) + b"\1\0\0\0\0\0\0\0" + b"\1\0\0\0" + b"\5\0\0\0helm\0")
    ['helm']
    """
    order = "<" if message[1:2] == b"\x01" else ">"
    try:
        _, at = _text(message, _ENCAPSULATION + _STAMP, order)
        count, at = _count(message, at, order)
        names = []
        for _ in range(min(count, _LONGEST)):
            name, at = _text(message, at, order)
            names.append(name)
    except (struct.error, UnicodeDecodeError):
        return []
    return names


def _count(message: bytes, at: int, order: str) -> tuple[int, int]:
    """Return a number of 32 bits, aligned to its size, and the place behind it."""
    at += -at % 4
    return int(struct.unpack_from(f"{order}I", message, at)[0]), at + 4


def _text(message: bytes, at: int, order: str) -> tuple[str, int]:
    length, at = _count(message, at, order)
    if at + length > len(message):
        raise struct.error("a string reaches beyond the message")
    return message[at : at + length].rstrip(b"\0").decode("utf-8"), at + length

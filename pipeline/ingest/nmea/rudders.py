"""The rudder angle of a ship with two rudders: the mean of both, where the second is one.

Many a ship with one rudder fills the port field too, with a zero or whatever its indicator holds. It counts as a second
rudder only where it follows the first.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import CODE, Flag, Float
from kempf.pipeline.ingest.nmea.fields import Said
from kempf.pipeline.ingest.nmea.frames import Frames
from kempf.pipeline.ingest.readings import Reason

_DEGREE = np.pi / 180.0

#: The rudder must have moved by as much before the port field is judged, rad.
_MOVES = 2.0 * _DEGREE
#: The port rudder turns by so much of what the starboard one turns.
_FOLLOWS = (0.5, 2.0)


def both_rudders(frames: Frames, said: dict[str, Said]) -> list[str]:
    """Bring the port rudder into the rudder angle, in place, instrument by instrument.

    Parameters
    ----------
    frames : Frames
    said : dict of str to Said
        What the sentences say, by type.

    Returns
    -------
    list of str
        What was done with a port field that is filled, one sentence an instrument.
    """
    if "RSA" not in said:
        return []
    rsa, notes = said["RSA"], []
    starboard, there = rsa.values["rudder_angle"]
    angle, status = rsa.fields.at(3), rsa.fields.at(4)
    port, filled = angle.number() * _DEGREE, angle.there() & status.is_one_of(("A",))
    address = frames.address[rsa.record]
    for code in np.unique(address[filled]):
        mine = address == code
        use, note = _judge(starboard, there & mine, port, filled & mine)
        notes.append(f"{frames.names[code]}: {note}")
        if use:
            both = mine & there & filled
            starboard[both] = 0.5 * (starboard[both] + port[both])
            alone = mine & filled & ~there
            starboard[alone], there[alone] = port[alone], True
            rsa.reason[alone & (rsa.reason == CODE[Reason.VOID])] = 0
    return notes


def _judge(starboard: Float, there: Flag, port: Float, filled: Flag) -> tuple[bool, str]:
    """Tell whether the port rudder is one, and say so."""
    both = there & filled & np.isfinite(starboard) & np.isfinite(port)
    if not there.any():
        return True, "the rudder angle is that of the port rudder, the only one that is valid."
    one, other = starboard[both], port[both]
    if both.any() and float(np.ptp(one)) >= _MOVES:
        slope = float(np.dot(one - one.mean(), other - other.mean()) / np.sum((one - one.mean()) ** 2))
        apart = float(np.degrees(np.sqrt(np.mean((other - one) ** 2))))
        if _FOLLOWS[0] <= slope <= _FOLLOWS[1]:
            return True, f"the rudder angle is the mean of both rudders, which differ by {apart:.2f} deg rms."
        return False, (
            f"the port field turns by {slope:.2f} times the starboard rudder, so it was taken for no second rudder."
        )
    return False, "the port field was left aside: the starboard rudder moves too little to tell whether it is a second."

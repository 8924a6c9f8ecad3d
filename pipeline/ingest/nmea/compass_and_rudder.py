"""What the whole log decides: the variation of magnetic headings, and whether a port rudder is there.

Many a ship with one rudder fills the port field too, with a zero or whatever its indicator holds. It counts as a second
rudder only where it follows the first.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import CODE, Flag, Float, Reason
from kempf.pipeline.ingest.nmea.fields import Fields, Said, east
from kempf.pipeline.ingest.nmea.frames import Frames
from kempf.pipeline.ingest.spans import Index
from kempf.schemas.channels import CHANNELS

_DEGREE = np.pi / 180.0

#: Fields of the variation and its side, in the order in which sentences are asked: the compass's own before the GNSS's.
_VARIATION = {"HDG": (4, 5), "RMC": (10, 11)}

#: The rudder must have moved by as much before the port field is judged, rad.
_MOVES = 2.0 * _DEGREE
#: The port rudder turns by so much of what the starboard one turns.
_FOLLOWS = (0.5, 2.0)


def make_true(frames: Frames, said: dict[str, Said], variation_deg: float | None = None) -> list[str]:
    """Add the variation to the headings of HDG and HDM, in place.

    A heading whose sentence lacks the variation is given the latest that one other source has sent, or the first where
    none was sent yet: it changes by less than a degree a day's sail. Where the log has none, it is that of the profile;
    without either a magnetic heading is no channel.

    Parameters
    ----------
    said : dict of str to Said
        What the sentences say, by type.
    variation_deg : float, optional
        Of the profile, deg, east positive.

    Returns
    -------
    list of str
        Notes where a variation was not that of the sentence itself, and where there was none.
    """
    notes: list[str] = []
    if not {"HDG", "HDM"} & set(said):
        return notes
    carried = _carried_variation(frames, said)
    for name in ("HDG", "HDM"):
        if name not in said:
            continue
        magnetic, there = said[name].values["heading"]
        variation, own = np.full(magnetic.shape, np.nan), np.zeros(magnetic.shape, dtype=np.bool_)
        if name == "HDG":
            variation, own = _variation(said[name].fields, name)
        lacking = np.flatnonzero(there & ~own)
        if carried is None and variation_deg is not None and lacking.size:
            variation[lacking] = variation_deg * _DEGREE
            notes.append(
                f"Magnetic headings of {name} were made true by the profile's variation of {variation_deg:g} deg; her "
                "deviation, and what it is off, is a constant error of the heading."
            )
        elif carried is None:
            reason = said[name].reason
            refused = lacking[reason[lacking] == 0]
            reason[refused] = CODE[Reason.NO_CHANNEL]
            if refused.size:
                notes.append(
                    f"{refused.size} magnetic headings of {name} were refused: no sentence gives the variation. Write "
                    "it into the profile, deg, east positive, such as variation_deg: 7.5"
                )
        elif lacking.size:
            at, value, teller = carried
            latest = np.searchsorted(at, said[name].record[lacking], side="right") - 1
            variation[lacking] = value[np.maximum(latest, 0)]
            low, high = np.degrees(value.min()), np.degrees(value.max())
            shown = f"{low:.1f}" if round(low, 1) == round(high, 1) else f"{low:.1f} to {high:.1f}"
            notes.append(
                f"Magnetic headings of {name} were made true by the variation that {teller} sends: {shown} deg."
            )
        # what is beyond one turn is not brought onto the circle here: nonsense would look like a heading
        known = (magnetic >= CHANNELS["heading"].low) & (magnetic <= CHANNELS["heading"].high)
        true_heading = np.mod(np.where(known, magnetic, 0.0) + variation, 2.0 * np.pi)
        said[name].values["heading"] = (np.where(known, true_heading, magnetic + variation), there)
    return notes


def _variation(fields: Fields, name: str) -> tuple[Float, Flag]:
    """Return the variation, rad, east positive, NaN for more than half a turn, and where the sentences give one."""
    place, side = _VARIATION[name]
    cells = fields.at(place)
    degrees = cells.number()
    degrees[np.abs(degrees) > 180.0] = np.nan
    return degrees * east(fields.at(side)) * _DEGREE, cells.there()


def _carried_variation(frames: Frames, said: dict[str, Said]) -> tuple[Index, Float, str] | None:
    """Return records and values of the variation that one source sends, and its name; None where there is none."""
    for name in _VARIATION:
        if name not in said:
            continue
        value, _ = _variation(said[name].fields, name)
        given = np.isfinite(value)
        if given.any():
            record = said[name].record[given]
            address = frames.address[record]
            most = int(np.bincount(address).argmax())
            at_address = address == most
            return record[at_address], value[given][at_address], frames.names[most]
    return None


def both_rudders(frames: Frames, said: dict[str, Said]) -> list[str]:
    """Bring the port rudder into the rudder angle, in place, instrument by instrument.

    Parameters
    ----------
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
        at_address = address == code
        use, note = _judge(starboard, there & at_address, port, filled & at_address)
        notes.append(f"{frames.names[code]}: {note}")
        if use:
            both = at_address & there & filled
            starboard[both] = 0.5 * (starboard[both] + port[both])
            alone = at_address & filled & ~there
            starboard[alone], there[alone] = port[alone], True
            rsa.reason[alone & (rsa.reason == CODE[Reason.VOID])] = 0
    return notes


def _judge(starboard: Float, there: Flag, port: Float, filled: Flag) -> tuple[bool, str]:
    """Return whether the port rudder is one, and say so."""
    both = there & filled & np.isfinite(starboard) & np.isfinite(port)
    if not there.any():
        return True, "the rudder angle is that of the port rudder, the only one that is valid."
    main, second = starboard[both], port[both]
    if both.any() and float(np.ptp(main)) >= _MOVES:
        slope = float(np.dot(main - main.mean(), second - second.mean()) / np.sum((main - main.mean()) ** 2))
        apart = float(np.degrees(np.sqrt(np.mean((second - main) ** 2))))
        if _FOLLOWS[0] <= slope <= _FOLLOWS[1]:
            return True, f"the rudder angle is the mean of both rudders, which differ by {apart:.2f} deg rms."
        return False, (
            f"the port field turns by {slope:.2f} times the starboard rudder, so it was taken for no second rudder."
        )
    return False, "the port field was left aside: the starboard rudder moves too little to show whether it is a second."

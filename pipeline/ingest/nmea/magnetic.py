"""From magnetic headings to true ones: the variation that a sentence tells itself, or another sentence of the log."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import CODE, Flag, Float
from kempf.pipeline.ingest.nmea.fields import Fields, Said, east
from kempf.pipeline.ingest.nmea.frames import Frames
from kempf.pipeline.ingest.readings import Reason
from kempf.pipeline.ingest.spans import Index
from kempf.schemas.channels import CHANNELS

_DEGREE = np.pi / 180.0

#: Fields of the variation and its side, in the order in which sentences are asked: the compass's own before the GNSS's.
_VARIATION = {"HDG": (4, 5), "RMC": (10, 11)}


def make_true(frames: Frames, said: dict[str, Said]) -> list[str]:
    """Add the variation to the headings of HDG and HDM, in place.

    A heading whose sentence lacks the variation is given the latest that one other source has told, or the first where
    none was told yet: it changes by less than a degree a day's sail. Where the log tells none, a magnetic heading is no
    channel.

    Parameters
    ----------
    frames : Frames
    said : dict of str to Said
        What the sentences say, by type.

    Returns
    -------
    list of str
        A note where a variation was carried from one sentence to another.
    """
    notes: list[str] = []
    if not {"HDG", "HDM"} & set(said):
        return notes
    carried = _told(frames, said)
    for name in ("HDG", "HDM"):
        if name not in said:
            continue
        magnetic, there = said[name].values["heading"]
        variation, own = np.full(magnetic.shape, np.nan), np.zeros(magnetic.shape, dtype=np.bool_)
        if name == "HDG":
            variation, own = _variation(said[name].fields, name)
        lacking = np.flatnonzero(there & ~own)
        if carried is None:
            reason = said[name].reason
            reason[lacking] = np.where(reason[lacking] == 0, CODE[Reason.NO_CHANNEL], reason[lacking])
        elif lacking.size:
            at, value, teller = carried
            latest = np.searchsorted(at, said[name].record[lacking], side="right") - 1
            variation[lacking] = value[np.maximum(latest, 0)]
            low, high = np.degrees(value.min()), np.degrees(value.max())
            shown = f"{low:.1f}" if round(low, 1) == round(high, 1) else f"{low:.1f} to {high:.1f}"
            notes.append(
                f"Magnetic headings of {name} were made true by the variation that {teller} tells: {shown} deg."
            )
        # what is no heading stays as it is, to be refused: on the circle it would look like one
        known = (magnetic >= CHANNELS["heading"].low) & (magnetic <= CHANNELS["heading"].high)
        made = np.mod(np.where(known, magnetic, 0.0) + variation, 2.0 * np.pi)
        said[name].values["heading"] = (np.where(known, made, magnetic), there)
    return notes


def _variation(fields: Fields, name: str) -> tuple[Float, Flag]:
    """Return the variation, rad, east positive, NaN for more than half a turn, and where the sentences tell one."""
    place, side = _VARIATION[name]
    cells = fields.at(place)
    degrees = cells.number()
    degrees[np.abs(degrees) > 180.0] = np.nan
    return degrees * east(fields.at(side)) * _DEGREE, cells.there()


def _told(frames: Frames, said: dict[str, Said]) -> tuple[Index, Float, str] | None:
    """Return records and values of the variation that one source tells, and its name; None where there is none."""
    for name in _VARIATION:
        if name not in said:
            continue
        value, _ = _variation(said[name].fields, name)
        tells = np.isfinite(value)
        if tells.any():
            record = said[name].record[tells]
            address = frames.address[record]
            most = int(np.bincount(address).argmax())
            mine = address == most
            return record[mine], value[tells][mine], frames.names[most]
    return None

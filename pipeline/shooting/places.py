"""Where a misfit one leg ahead sits: in which channel, manoeuvre and leg, at how much rudder, turn and drift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.record.moves import moved
from kempf.pipeline.shooting.windows import Windows

#: part of the misfit that a place holds beyond its part of the windows, and how many times that part, to stand out
EXCESS, TIMES = 0.1, 1.5
#: by rudder, turn and drift the windows are cut into so many parts of one size
_PARTS = ("least", "middle", "most")


@dataclass(frozen=True)
class MisfitPart:
    """A part of the windows, and how much of the misfit it holds."""

    #: ``manoeuvre``, ``leg``, ``rudder``, ``yaw_rate`` or ``drift``.
    by: str
    #: Of the manoeuvre; number of the leg, 0 before the first execute; ``least``, ``middle`` or ``most``.
    name: str
    #: Part of the misfit that these windows hold.
    share: float
    #: Part of all windows that they are.
    of_windows: float

    @property
    def excess(self) -> float:
        """How much more of the misfit they hold than as many windows would if all were alike."""
        return self.share - self.of_windows

    @property
    def stands_out(self) -> bool:
        """Whether that is much: of a few manoeuvres one holds somewhat more than the others by chance."""
        return self.excess > EXCESS and self.share > TIMES * self.of_windows


@dataclass(frozen=True)
class Places:
    """Where a misfit sits."""

    #: Part of it in v, r and psi; NaN where not measured.
    channels: tuple[float, float, float]
    #: Every part of every cut.
    places: tuple[MisfitPart, ...]

    def most(self, *by: str) -> MisfitPart | None:
        """Return the place of these cuts that holds most beyond its part of the windows; None where none stands out."""
        there = (place for place in self.places if place.by in by and place.stands_out)
        return max(there, key=lambda place: place.excess, default=None)


def places(windows: Sequence[Windows], errors: Sequence[Float]) -> Places | None:
    """Return where a misfit sits; None where a model runs away, or nothing is left at all.

    Parameters
    ----------
    windows : sequence of Windows
        One a manoeuvre.
    errors : sequence of ndarray, shape (w, 3)
        Mean squares by window and channel in units of the scales, NaN where not measured.
    """
    each = np.concatenate(errors)
    made = np.isfinite(each)
    total = np.sum(np.where(made, each, 0.0), axis=1)
    if np.isinf(each).any() or np.sum(total) <= 0.0:
        return None
    columns = np.sum(np.where(made, each, 0.0), axis=0) / np.sum(total)
    channels = [float(part) if made[:, i].any() else float("nan") for i, part in enumerate(columns)]
    names = [manoeuvre.run.name for manoeuvre in windows for _ in manoeuvre.begins]
    # the leg in which the middle of a window lies
    legs = np.concatenate(
        [moved(manoeuvre.run.rudder_rad)[(manoeuvre.begins + manoeuvre.ends) // 2] for manoeuvre in windows]
    )
    cuts = {"manoeuvre": np.array(names), "leg": legs.astype(str)}
    sizes = np.concatenate([_sizes(manoeuvre) for manoeuvre in windows])
    for column, by in enumerate(("rudder", "yaw_rate", "drift")):
        size = sizes[:, column]
        if np.all(np.isfinite(size)):
            rank = np.argsort(np.argsort(size, kind="stable"), kind="stable")
            cuts[by] = np.array(_PARTS)[rank * len(_PARTS) // size.size]
    groups = [
        MisfitPart(by, str(name), float(np.sum(total[cut == name]) / np.sum(total)), float(np.mean(cut == name)))
        for by, cut in cuts.items()
        for name in dict.fromkeys(cut.tolist())
    ]
    return Places((channels[0], channels[1], channels[2]), tuple(groups))


def _sizes(windows: Windows) -> Float:
    """Return the root mean squares of rudder, turn and drift angle in every window, shape (w, 3)."""
    run = windows.run
    speed = np.maximum(run.inputs[::ROWS, 0], 1e-3 * max(run.approach_m_s, 1e-6))
    courses = np.column_stack([run.rudder_rad, run.measured[:, 1], run.measured[:, 0] / speed])
    sizes = np.full((windows.begins.size, 3), np.nan)
    for w, (begin, end) in enumerate(zip(windows.begins, windows.ends, strict=True)):
        part = courses[begin : end + 1]
        made = np.isfinite(part)
        many = np.count_nonzero(made, axis=0)
        squares = np.sum(np.where(made, part, 0.0) ** 2, axis=0)
        sizes[w, many > 0] = np.sqrt(squares[many > 0] / many[many > 0])
    return sizes

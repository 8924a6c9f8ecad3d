"""What others measured and predicted of the tank's ship, beside what her zigzags say: circles and overshoots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import radians
from pathlib import Path
from typing import Any

import yaml

from benchmarks import result_page
from benchmarks.baselines.mmg_standard import Peer
from kempf.flows.jobs.predict.predicted import SetPrediction

_FILE = Path(__file__).parents[1] / "peers" / "kvlcc2.yaml"
_RUDDER_RAD = radians(35.0)
#: as the file has them, and as predictions do
_FIGURES = {"advance": "advance_m", "tactical_diameter": "tactical_diameter_m"}


@dataclass(frozen=True)
class Circle:
    """A turning circle of somebody else."""

    who: str
    kind: str
    side: str
    #: In metres, by the names of ``_FIGURES``.
    figures_m: Mapping[str, float]


@cache
def data() -> dict[str, Any]:
    """Return the file of peers."""
    found: dict[str, Any] = yaml.safe_load(_FILE.read_text(encoding="utf-8"))
    return found


def circles() -> list[Circle]:
    """Return the published circles, and those that the published coefficients give."""
    length = data()["length_m"]
    found = [
        Circle(one["who"], one["kind"], one["side"], {name: one[name] * length for name in _FIGURES})
        for one in data()["circles"]
    ]
    peer = Peer.of(data())
    for side, sign in (("starboard", 1), ("port", -1)):
        made = peer.circle(sign * _RUDDER_RAD)
        figures = {name: float(getattr(made, figure)) for name, figure in _FIGURES.items()}
        found.append(Circle("MMG standard method, computed here", "predicted", side, figures))
    return found


def overshoots(heading_deg: float, rudder_deg: float, side: str, rudder_rate_rad_s: float) -> str:
    """Return the first two overshoots of a zigzag by the published coefficients, with the gear of the other basin."""
    peer = Peer(data()["length_m"], data()["speed_m_s"], rudder_rate_rad_s, data()["mmg"])
    sign = 1 if side == "starboard" else -1
    return ", ".join(f"{x:.3g}" for x in peer.overshoots_deg(radians(heading_deg), radians(rudder_deg), sign))


def circles_beside(predicted: Callable[[str, float], SetPrediction]) -> list[str]:
    """Return the part of the page with circles of both sides.

    Parameters
    ----------
    predicted : callable
        Returns the prediction of the circle with 35 deg of rudder to a side, with a rudder rate, deg/s.
    """
    rate, others = data()["rudder_rate_deg_s"], circles()
    rows = []
    for side in ("starboard", "port"):
        made = predicted(side, rate).prediction.figures
        for name, figure in _FIGURES.items():
            rows.append([f"{name.replace('_', ' ')}, {side}", *_row(made[figure], name, side, others)])
    names = list(dict.fromkeys(one.who for one in others if one.kind == "predicted"))
    heads = ["35 deg of rudder, m", "measured by MARIN", "from her zigzags at HSVA (95 %)", "off by", *names]
    return [
        f"The same circle with the gear of the basin where it was measured, whose rudder goes over at {rate:g} deg/s, "
        "and peers from captive tests; sources, and how each figure was read, in `benchmarks/peers/kvlcc2.yaml`. None "
        "of it is fitted to.",
        "",
        *result_page.table(heads, rows),
        "",
    ]


def _row(ours: Any, name: str, side: str, others: Sequence[Circle]) -> list[str]:
    measured = next(one.figures_m[name] for one in others if one.kind == "measured" and one.side == side)
    inside = ours.low <= measured <= ours.high
    cells = [f"{measured:.2f}", f"{ours.value:.2f} ({ours.low:.2f} to {ours.high:.2f}{'' if inside else ', outside'})"]
    cells.append(f"{100.0 * (ours.value / measured - 1.0):+.1f} %")
    for who in dict.fromkeys(one.who for one in others if one.kind == "predicted"):
        theirs = [one.figures_m[name] for one in others if one.who == who and one.side == side]
        cells += [f"{x:.2f}: {100.0 * (x / measured - 1.0):+.1f} %" for x in theirs] or [""]
    return cells

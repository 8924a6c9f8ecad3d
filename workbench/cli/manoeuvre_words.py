"""What ``kempf segments`` says of a manoeuvre that is no zigzag: its figures in metres and lengths, with intervals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from kempf.workbench.manoeuvre_figures import FIGURES
from kempf.workbench.numbers import number

if TYPE_CHECKING:
    from kempf.warehouse.tables.segments import Segment

_DIGITS = 3


def headline(segment: Segment) -> str:
    """Return which manoeuvre it was, in words."""
    rudder = f"{segment.delta0_deg:.3g} deg to {segment.first_side}"
    if segment.kind == "turning_circle":
        turned = abs(float(segment.detail["heading_change_deg"]))
        return f"turning circle, rudder {rudder}, turned {turned:.0f} deg, track from {segment.detail['track']}"
    if segment.kind == "random_manoeuvre":
        orders, range_deg = len(segment.executes_utc_ns), segment.detail["heading_range_deg"]
        return f"random manoeuvre, {orders} orders of up to {rudder}, headings over {range_deg:.0f} deg"
    if segment.kind == "pull_out":
        verdict = segment.detail["verdict"]
        pair = {
            "unstable": "the pair shows: unstable on a straight course",
            "no instability seen": "the pair shows no instability",
        }
        return f"pull-out from {rudder}; {pair.get(verdict, 'not judged')}"
    loop = {"seen": "loop seen", "none seen": "no loop seen", "not judged": "a loop cannot be seen"}
    points = segment.detail["points"]
    return f"spiral, {len(points)} steps from {rudder}; {loop[segment.detail['loop']]}"


def figures(segment: Segment) -> list[str]:
    """Return its figures, one sentence each, and what is to be known before trusting them."""
    length = segment.detail.get("length_m")
    known = segment.detail.get("figures", {})
    lines = [_figure(*FIGURES[name], known[name], length) for name in FIGURES if name in known]
    for point in segment.detail.get("points", ()):
        rate = point["yaw_rate_deg_s"]
        steady = "" if point["steady"] else ", not steady yet"
        lines.append(f"{point['rudder_deg']:+.1f} deg: {_with_interval(rate)} deg/s{steady}")
    criteria = {name: _criterion(name, criterion) for name, criterion in segment.imo.items()}
    return [*lines, *criteria.values(), *segment.quality["reasons"]]


def _figure(words: str, unit: str, figure: Mapping[str, Any], length_m: float | None) -> str:
    if figure["value"] is None:
        return f"{words}: not known, {figure['why']}"
    lengths = f", {figure['value'] / length_m:.2f} L" if unit == "m" and length_m else ""
    why = f", {figure['why']}" if figure["low"] is None and figure["why"] else ""
    return f"{words}: {_with_interval(figure)} {unit}{lengths}{why}"


def _with_interval(figure: Mapping[str, Any]) -> str:
    value = number(figure["value"], _DIGITS)
    if figure["low"] is None:
        return value
    return f"{value} ({number(figure['low'], _DIGITS)} to {number(figure['high'], _DIGITS)})"


def _criterion(name: str, criterion: Mapping[str, Any]) -> str:
    if criterion["passed"] is None:
        return f"IMO {name} n/a: {criterion['why']}"
    return f"IMO {name} {'passed' if criterion['passed'] else 'FAILED'}: at most {criterion['limit_lengths']:g} L"

"""What the program says of one vessel's measured logs: the diagnosis in lines of a results page. Knows no answer."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks import measured_ships, result_page
from benchmarks.measured_ships import Ship
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.diagnose.verdicts.verdict import verdict
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse

_DEG = 57.29577951308232
#: what an outcome that names effects begins with
CLAIMED = "claimed: "
#: candidates listed beside those that were found
_SHOWN = 8


def diagnosed(ship: Ship, spec: ModelSpec) -> Mapping[str, Any]:
    """Take a ship's logs in and diagnose her, as `kempf ingest` and `kempf diagnose --json` do."""
    with TemporaryDirectory() as place:
        warehouse = Warehouse(str(Path(place)))
        measured_ships.take_in(warehouse, ship)
        return diagnose_vessel(warehouse, ship.name, spec)[0].as_json()


def section(stated: Mapping[str, Any]) -> list[str]:
    """Return a vessel's part of the page."""
    lines = [f"## {stated['vessel']}: {stated['verdict'].replace('_', ' ')}", ""]
    lines += [f"- {sentence}" for sentence in stated["sentences"]]
    lines += ["", *result_page.table(LADDER, [rung_row(stated, one) for one in stated["ladder"]]), ""]
    found = ("present", "immaterial", "suspected")
    shown = [c for c in stated["candidates"] if c["verdict"] in found]
    shown += [c for c in stated["candidates"] if c["verdict"] not in found and c["score"] is not None][:_SHOWN]
    rows = [
        [c["effect"], _number(c["score"], ".1f"), _change(c), _number(c["absorption"], ".4f"), c["verdict"], c["why"]]
        for c in shown
    ]
    lines += result_page.table(["effect", "score", "expected change", "absorbed", "verdict", "why"], rows)
    blind = [c["effect"] for c in stated["candidates"] if c["verdict"] == "not_testable"]
    if blind:
        lines += ["", f"Not testable with these data: {', '.join(blind)}."]
    return [*lines, ""]


def outcome_of(found: Diagnosis) -> str:
    """Return the effects that are claimed, or the verdict where none is."""
    names = [step.added.name for step in found.steps if step.added is not None]
    return f"{CLAIMED}{' + '.join(names)}" if names else verdict(found)


LADDER = (
    *("step", "added", "a leg ahead: fitted, %", "left out, %", "held out, %", "left out, worst, %"),
    *("free run: fitted, %", "held out, %", "yaw rate, deg/s", "heading, deg", "lateral speed, m/s"),
    *("wind, m/s²/√s", "log-likelihood"),
)


def rung_row(stated: Mapping[str, Any], one: Mapping[str, Any]) -> list[str]:
    """Return one rung of a ladder, under the columns `LADDER`."""
    runs = one["held_out"] or one["in_sample"]
    rms = {
        channel: (sum((run[channel] or 0.0) ** 2 for run in runs.values()) / len(runs)) ** 0.5
        for channel in ("yaw_rate", "heading", "lateral_speed")
    }
    return [
        str(one["step"]),
        one["added"] or "plain model",
        *_ahead(one["one_leg_ahead"]),
        _percent(one["in_sample_error"], one["in_sample"]),
        _percent(one["held_out_error"], one["held_out"]),
        f"{rms['yaw_rate'] * _DEG:.4f}",
        f"{rms['heading'] * _DEG:.3f}",
        f"{rms['lateral_speed']:.4f}",
        f"{one['disturbance_intensity']['wind_force_m_s2_per_sqrt_s']:.2g}",
        f"{one['log_likelihood']:.1f}",
    ]


def _ahead(one: Mapping[str, Any] | None) -> list[str]:
    if one is None:
        return ["", "", "", ""]
    samples = [list(one[f"{name}_percent"].values()) for name in ("fitted", "left_out", "held_out")]
    means = ["" if not s else "diverges" if None in s else f"{sum(s) / len(s):.2f}" for s in samples]
    return [*means, "diverges" if None in samples[1] else f"{max(samples[1]):.2f}"]


def _percent(error: float | None, runs: Mapping[str, Any]) -> str:
    if not runs:
        return "none held out"
    return "diverges" if error is None else f"{100 * error:.2f}"


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def _change(candidate: Mapping[str, Any]) -> str:
    stated = []
    for name, c in candidate["expected_change"].items():
        std = "" if c["std"] is None else f" ± {c['std']:.2g}"
        value = "" if c["value"] is None else f"{c['value']:.3g}"
        stated.append(f"{name} {value}{std} {c['unit']}".rstrip())
    return ", ".join(stated)

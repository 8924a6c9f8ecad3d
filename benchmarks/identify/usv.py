"""A small unmanned vessel in open water: one 30/30 zigzag and a turning circle, 2 Hz GNSS, compass and rudder."""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

mpl.use("Agg")
import matplotlib.pyplot as plt

from benchmarks import measured_ships, result_page
from benchmarks.identify import plausibility
from benchmarks.identify.draw_predicted import draw_predicted
from benchmarks.identify.linear_ahead import predict_ahead
from kempf.flows.jobs.identify.identify_vessel import IdentifyOutcome, identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, search
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.warehouse.tables.segments import Segment

#: A boat that makes way does not drift like this for one sample: the course is wrong there.
_WRONG_RAD = np.deg2rad(20.0)
#: how far ahead is predicted, and which of it is drawn
HORIZONS_S, DRAWN_S = (2.0, 5.0, 10.0, 20.0), 5.0


def wrong(instruments: Instruments, record: Record) -> NDArray[np.bool_]:
    """Where course and heading cannot both be right, shape (n,)."""
    course, heading = instruments.series["course_over_ground"], instruments.series["heading"]
    time = record.lateral.time_utc_ns
    drift = course.at(time, 1.0) - heading.at(time, 1.0)
    far: NDArray[np.bool_] = np.abs(np.angle(np.exp(1j * drift))) > _WRONG_RAD
    return far


def draw(instruments: Instruments, record: Record, segment: Segment, path: Path) -> None:
    """Draw heading and rudder above, the lateral speed of eq. (18) with its standard error below."""
    figure, (above, below) = plt.subplots(2, 1, figsize=(11, 7), sharex=True, layout="constrained")
    origin = segment.executes_utc_ns[0]
    heading, rudder = instruments.series["heading"], instruments.series["rudder_angle"]
    turn = 360.0 * round((float(np.rad2deg(np.mean(heading.value))) - segment.base_heading_deg) / 360.0)
    deviation = np.rad2deg(heading.value) - segment.base_heading_deg - turn
    above.plot(heading.seconds_since(origin), deviation, color="tab:blue", label="heading less $K_0$")
    above.plot(rudder.seconds_since(origin), np.rad2deg(rudder.value), color="tab:orange", label="rudder")
    for side in (1, -1):
        above.axhline(side * segment.psi0_deg, color="0.5", lw=0.8, ls="--")
    for o in segment.detail["overshoots"]:
        side = 1 if o["side"] == "starboard" else -1
        y = side * (segment.psi0_deg + o["beyond_nominal_deg"])
        above.plot((o["peak_utc_ns"] - origin) / 1e9, y, "o", ms=4, color="tab:red")
    above.set_ylabel("deg, positive to starboard")
    title = f"{segment.psi0_deg:g}/{segment.delta0_deg:g}, first to {segment.first_side}, $K_0$ = "
    above.set_title(f"{title}{segment.base_heading_deg:.1f}° (middle of the switching headings)", fontsize=10)
    above.legend(loc="lower right", ncols=2, fontsize=8)
    lateral = record.lateral
    seconds = (lateral.time_utc_ns - origin).astype(np.float64) / 1e9
    off = wrong(instruments, record)
    value = np.where(off, np.nan, lateral.value_m_s)
    low, high = value - 2.0 * lateral.std_m_s, value + 2.0 * lateral.std_m_s
    below.fill_between(seconds, low, high, color="tab:green", alpha=0.35, lw=0, label="± 2 standard errors")
    below.plot(seconds, value, color="tab:green", lw=1.0, label="$y_v = V_{GNSS}\\,\\sin(COG - K)$")
    reach = 1.15 * float(np.nanmax(np.abs(value)))
    edge = np.full(int(off.sum()), 0.97 * reach)
    below.plot(seconds[off], edge, "x", color="tab:red", ms=6, label="course wrong: drift above 20°, far outside")
    below.set_ylim(-reach, reach)
    below.set_ylabel("lateral speed over ground, m/s")
    below.set_xlabel("s after the first execute")
    below.legend(loc="upper left", ncols=3, fontsize=8)
    for panel in (above, below):
        for ns in segment.executes_utc_ns:
            panel.axvline((ns - origin) / 1e9, color="k", lw=0.6, ls=":")
        panel.axhline(0.0, color="0.7", lw=0.6)
        panel.grid(lw=0.3)
    figure.savefig(path, dpi=80, metadata={"Software": None})
    plt.close(figure)


def lateral_lines(summary: dict[str, Any]) -> list[str]:
    """Table of the summary of eq. (18) that the segment carries."""
    noise = summary["noise_std"]
    rows = [
        ["values", str(summary["n"])],
        ["rms of y_v, m/s", f"{summary['rms_m_s']:.3f}"],
        ["median standard error of y_v, m/s", f"{summary['median_std_m_s']:.3f}"],
        ["largest drift angle COG - K, deg", f"{summary['largest_drift_deg']:.1f}"],
        ["noise of the speed, m/s", f"{noise['speed_over_ground_m_s']:.3f}"],
        ["noise of the course, deg", f"{np.rad2deg(noise['course_over_ground_rad']):.2f}"],
        ["noise of the heading, deg", f"{np.rad2deg(noise['heading_rad']):.2f}"],
    ]
    return result_page.table(["eq. (18) over the zigzag", ""], rows)


def artefact_lines(instruments: Instruments, record: Record) -> list[str]:
    """What is wrong with the course in the file, and what it does to the figures."""
    off, y = wrong(instruments, record), record.lateral.value_m_s
    seconds = (record.lateral.time_utc_ns - record.start_utc_ns).astype(np.float64) / 1e9
    heading = np.interp(seconds, record.time_s, record.heading_rad)
    from_north = np.rad2deg(np.max(np.abs(np.angle(np.exp(1j * heading[off])))))
    clean = float(np.sqrt(np.nanmean(y[~off] ** 2)))
    gone = int(np.count_nonzero(off & ~np.isfinite(y)))
    return [
        f"At {int(off.sum())} of {off.size} instants course and heading differ by more than 20 deg, all with the bow "
        f"within {from_north:.0f} deg of north: the file's course was interpolated from 359 to 1 through 180 before it",
        f"was delivered. {gone} of them are found as jumps of the velocity and left out before the fit. Without all of",
        f"them the rms of y_v is {clean:.3f} m/s. The table above is of the file as it is.",
    ]


def set_lines(made: ParameterSet) -> list[str]:
    """What was identified, and what is odd about it."""
    value, std = plausibility.values(made)
    units = [p.unit for p in made.parameters]
    rows = [[n, f"{v:.4g}", f"{s:.2g}", u] for n, v, s, u in zip(HULL_PARAMETERS, value, std, units, strict=True)]
    fits = [
        [name, f"{c['rms']:.4f}", f"{c['fit_percent']:.0f}", f"{c['lag1_autocorrelation']:.2f}"]
        for name, c in made.fit["channels"].items()
    ]
    state = "converged" if made.convergence["converged"] else f"not converged: {made.convergence['reason']}"
    return [
        f"Stored, {state} after {made.convergence['iterations']} steps. Warnings of the set:",
        "",
        *(f"- {warning}" for warning in made.warnings),
        "",
        *result_page.table(["parameter", "value", "standard error", "unit"], rows),
        "",
        *result_page.table(["one step ahead", "rms, m/s or rad", "fit, %", "lag-1 autocorrelation"], fits),
        "",
        f"Odd: {'; '.join(plausibility.odd(made)) or 'nothing'}.",
    ]


def predicted_lines(record: Record, made: ParameterSet) -> list[str]:
    """How many measurements the intervals of predictions cover, by horizon, and the figure."""
    objective, best, _, _, _ = search(record, ModelSpec().with_arm(None), 0.0, MaximumLikelihoodSettings())
    rows = [
        ["one step", *(f"{c['inside_95_percent'] * c['n']:.0f} of {c['n']}" for c in made.fit["channels"].values())]
    ]
    names = list(made.fit["channels"])
    for horizon in HORIZONS_S:
        ahead = predict_ahead(objective, best.theta, horizon)
        inside = ahead.inside()
        rows.append([f"{0.5 * horizon:g} to {horizon:g} s", *(f"{inside[n][0]} of {inside[n][1]}" for n in names)])
        if horizon == DRAWN_S:
            draw_predicted(objective.record, ahead, result_page.RESULTS / "usv_predicted.png")
    return [
        "## Predicted against measured",
        "",
        "Measurements inside their 95 % interval, of those that the gate left; the parameters fitted to this run.",
        "",
        *result_page.table(["ahead", *(name.replace("_", " ") for name in names)], rows),
        "",
        "![Measured over predicted](usv_predicted.png)",
    ]


def page(
    taken: list[IngestOutcome],
    identified: list[IdentifyOutcome],
    verdicts: list[str],
    records: dict[str, Record],
    instruments: dict[str, Instruments],
) -> list[str]:
    """Lines of the page."""
    rows = []
    for outcome in taken:
        tally = outcome.tally
        found = ", ".join(f"{s.psi0_deg:g}/{s.delta0_deg:g} {s.first_side}" for s in outcome.segments)
        closed = f"{tally.records_read} = {tally.records_kept} + {tally.records_rejected}" if tally else "failed"
        rows.append([Path(outcome.path).name, closed, found or "none"])
    lines = [
        *result_page.table(["log", "rows read = kept + rejected", "zigzags"], rows),
        "",
    ]
    for one, verdict in zip(identified, verdicts, strict=True):
        segment = one.segment
        overshoots = ", ".join(f"{a:.1f}" for a in segment.overshoots_deg)
        said = " ".join(segment.quality["reasons"]) or "nothing"
        lines += [
            f"{len(segment.executes_utc_ns)} executes, overshoots beyond psi0 {overshoots} deg. Said of it: {said}",
            "",
            *lateral_lines(dict(segment.detail["lateral_speed"])),
            "",
            *artefact_lines(instruments[segment.segment_id], records[segment.segment_id]),
            "",
            *(set_lines(one.parameter_set) if one.parameter_set else [f"No parameter set: {one.error}"]),
            "",
            f"Rebuilt from the raw bytes: {verdict}.",
            "",
            *(predicted_lines(records[segment.segment_id], one.parameter_set) if one.parameter_set else []),
            "",
        ]
    return [*lines, "![Heading, rudder and lateral speed](usv.png)"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    options = parser.parse_args()
    result_page.RESULTS.mkdir(exist_ok=True)
    with TemporaryDirectory() as folder:
        warehouse, ship = Warehouse(folder), measured_ships.boat(options.data)
        taken = measured_ships.take_in(warehouse, ship)
        identified = identify_vessel(warehouse, ship.name)
        verdicts, records, series = [], {}, {}
        for outcome in identified:
            made, segment = outcome.parameter_set, outcome.segment
            verdicts.append(rerun(warehouse, made.parameter_set_id).verdict if made else "nothing to rebuild")
            instruments = channels_of(warehouse, segment.ingest_id)
            record = make_record(instruments, segment.start_utc_ns, segment.end_utc_ns)
            records[segment.segment_id], series[segment.segment_id] = record, instruments
            draw(instruments, record, segment, result_page.RESULTS / "usv.png")
    path = result_page.write(
        "identify.usv", "A small unmanned vessel in open water", page(taken, identified, verdicts, records, series)
    )
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()

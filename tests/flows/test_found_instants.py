"""Rows of half a second: the runs are laid out at the instants at which the instruments measured."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN
from kempf.flows.jobs.identify.vessel_model import store_model
from kempf.flows.jobs.identify.vessel_runs import RunLayout, layout_of
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.pipeline.channels.found_instants import AS_TAKEN, FoundInstants
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.pipeline.diagnose.screening.found_instants import FittedRuns, at_found_instants, fitted_runs
from kempf.pipeline.diagnose.screening.unsure_instants import with_instants
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import Trial, simulate_trial, zigzag_settings
from kempf.schemas.effects import get
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import MILLISECOND_NS, SECOND_NS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from tests.flows.content import fresh

DAY_NS = 86_400_000_000_000
ROW_S = 0.5
#: instruments of the simulator by the field of what is found of them; the rudder's counts the other way
INSTRUMENTS = {"velocity_s": ("gnss", 1), "heading_s": ("heading", 1), "yaw_rate_s": ("yaw_rate", 1)}
INSTRUMENTS |= {"rudder_s": ("rudder", -1)}


@dataclass(frozen=True)
class Sailed:
    trials: list[Trial]
    warehouse: Warehouse
    layout: RunLayout
    as_taken: FittedRuns
    found: FittedRuns


def trial_of(day: int) -> Trial:
    settings = zigzag_settings("ferry", duration_s=300.0, steady_s=40.0, seed=300 + day)
    return simulate_trial(replace(settings, start_utc_ns=settings.start_utc_ns + day * DAY_NS))


def laid_out(trials: list[Trial], folder: Path) -> tuple[Warehouse, RunLayout]:
    warehouse = fresh(folder / "w")
    for day, trial in enumerate(trials):
        log = LogFile(to_csv(trial, rate_hz=1.0 / ROW_S))
        ingest_log(warehouse, "ferry", f"day{day}.csv.gz", log, logger_profile(trial.settings), "ferry")
    return warehouse, layout_of(warehouse, choose(warehouse, "ferry"), ModelSpec())


@pytest.fixture(scope="module")
def sailed(tmp_path_factory: pytest.TempPathFactory) -> Sailed:
    trials = [trial_of(day) for day in (0, 1)]
    warehouse, layout = laid_out(trials, tmp_path_factory.mktemp("sailed"))
    return Sailed(trials, warehouse, layout, fitted_of(layout), found_in(layout))


def fitted_of(layout: RunLayout, *effects: str) -> FittedRuns:
    runs = layout.runs()
    with ThreadPoolExecutor(2) as workers:
        return fitted_runs(runs.runs, runs.spec, [get(name) for name in effects], workers)


def found_in(layout: RunLayout, *effects: str) -> FittedRuns:
    with ThreadPoolExecutor(2) as workers:
        return at_found_instants(
            fitted_of(layout, *effects),
            layout.runs_at,
            [get(name) for name in effects],
            workers,
        )


def lateness_s(trial: Trial, name: str) -> float:
    """By how much an instrument measured before the instants that are taken for it: the last value, half a row ago."""
    record, arrivals = trial.record(name), [one.arrival_utc_ns for one in trial.instruments]
    # the first row stands at the millisecond in which all have been heard
    first = -(-max(int(one[0]) for one in arrivals) // MILLISECOND_NS) * MILLISECOND_NS
    rows = np.arange(first, min(int(one[-1]) for one in arrivals), round(ROW_S * SECOND_NS))
    held = np.searchsorted(record.arrival_utc_ns, rows, side="right") - 1
    new = np.concatenate([[False], np.diff(held) > 0])
    taken = rows[new] - round(0.5 * ROW_S * SECOND_NS)
    return float(np.mean(taken - record.measured_utc_ns[held[new]])) / SECOND_NS


def test_instants_are_found_where_the_instruments_measured(sailed: Sailed) -> None:
    assert [run.day for run in sailed.found.runs] == [0, 1] and sailed.found.found
    for day, run in enumerate(sailed.found.runs):
        for field, (name, sign) in INSTRUMENTS.items():
            right = sign * lateness_s(sailed.trials[day], name)
            # the velocity's is hardly seen, and stays near the middle of the row
            off = getattr(run.instant_errors.found, field) - right
            assert abs(off) < (0.2 if field == "velocity_s" else 0.1), (day, field, off)


def test_the_runs_fit_better_and_the_hull_is_right(sailed: Sailed) -> None:
    as_taken, fit = sailed.as_taken.fits[-1], sailed.found.fits[-1]
    with ThreadPoolExecutor(2) as workers:
        first, settled = (with_instants(one, workers) for one in (as_taken, fit))
    assert first.gain > 50.0 and settled.gain < 6.0
    assert fit.log_likelihood > as_taken.log_likelihood + 0.2 * first.gain
    true = np.array(astuple(sailed.trials[0].settings.hull.parameters))
    off = (settled.fit.hull - true) / np.sqrt(np.diag(fit.covariance + settled.covariance))[:6]
    assert np.all(np.abs(off) < 3.5)


def test_laid_out_anew_from_anew_is_the_same(sailed: Sailed) -> None:
    found = {run.day: run.instant_errors.found for run in sailed.found.runs}
    layout = sailed.layout.moved({day: FoundInstants(0.1, 0.1, 0.1, 0.1) for day in found}).moved(found)
    for one, other in zip(sailed.found.runs, layout.runs().runs, strict=True):
        assert np.array_equal(one.measured, other.measured, equal_nan=True)
        assert np.array_equal(one.inputs, other.inputs) and np.array_equal(one.offset_s, other.offset_s)
    back = layout.moved(dict.fromkeys(found, AS_TAKEN))
    for log_id, log in sailed.layout.instruments.items():
        for name, one in log.series.items():
            assert np.array_equal(one.time_utc_ns, back.instruments[log_id].series[name].time_utc_ns)


def test_what_is_later_than_its_rows_allow_stays_to_be_diagnosed(sailed: Sailed) -> None:
    late_ns = round(1.2 * SECOND_NS)
    late = {
        log_id: replace(one, series={**one.series, "yaw_rate": one.series["yaw_rate"].earlier(-late_ns)})
        for log_id, one in sailed.layout.instruments.items()
    }
    made = found_in(replace(sailed.layout, instruments=late))
    assert not made.found and all(run.instant_errors.found == AS_TAKEN for run in made.runs)


def test_a_dead_time_of_the_model_is_not_taken_for_the_rows(sailed: Sailed) -> None:
    early_ns = round(0.5 * SECOND_NS)
    early = {
        log_id: replace(one, series={**one.series, "rudder_angle": one.series["rudder_angle"].earlier(early_ns)})
        for log_id, one in sailed.layout.instruments.items()
    }
    layout = replace(sailed.layout, instruments=early)
    as_taken, made = (fits[-1] for fits in (fitted_of(layout, "dead_time").fits, found_in(layout, "dead_time").fits))
    assert as_taken.values[-1] > 0.2
    assert made.values[-1] == pytest.approx(as_taken.values[-1], abs=0.15)


def test_a_ship_of_slow_rows_lacks_nothing_and_her_model_is_that_of_identification(
    sailed: Sailed, tmp_path: Path
) -> None:
    folder = sailed.warehouse.folder
    assert folder is not None
    other = Warehouse(str(copytree(folder, tmp_path / "w")))
    stored, _ = diagnose_vessel(sailed.warehouse, "ferry", ModelSpec())
    assert not stored.effects and stored.verdict == "insufficient_data"
    assert stored.content["sets"] == stored.content["immaterial"] == []
    assert len(stored.content["instants"]) == 2 and "which take the middle" in stored.content["sentences"][-1]
    base = parameter_sets.get(sailed.warehouse, stored.parameter_set_id)
    again, new = store_model(other, choose(other, "ferry"), ModelSpec(), NONE_OF_ONES_OWN)
    assert new and again.parameter_set_id == base.parameter_set_id
    assert again.parameters == base.parameters and again.convergence == base.convergence
    assert stored.content["ladder"][0]["log_likelihood"] > base.convergence["log_likelihood"] + 20.0


def test_velocities_of_the_ship_s_frame_are_turned_by_the_heading_of_their_instants() -> None:
    time = np.arange(0, 100 * SECOND_NS, SECOND_NS // 2)
    heading = Series(time, 0.01 * time / SECOND_NS)
    readings = {"velocity_forward": Series(time, np.full(time.size, 5.0)), "heading": heading}
    readings["velocity_starboard"] = Series(time, np.full(time.size, 0.5))
    series = {**readings, "speed_over_ground": Series(time, np.full(time.size, 5.0)), "course_over_ground": heading}
    log = Instruments(series, dict.fromkeys(series, "row"), (), frozenset({"speed_over_ground", "course_over_ground"}))
    moved = log.moved(FoundInstants(velocity_s=0.2, heading_s=0.1))
    course = moved.series["course_over_ground"]
    assert set(course.time_utc_ns) <= set(time - SECOND_NS // 5) and course.time_utc_ns.size > 190
    # at the velocity's instant the compass shows what it read 0.1 s later by its own clock
    expected = 0.01 * (course.time_utc_ns / SECOND_NS + 0.1) + np.arctan2(0.5, 5.0)
    assert course.value == pytest.approx(expected, abs=1e-9)
    assert moved.moved(FoundInstants()).series["heading"].time_utc_ns[0] == 0

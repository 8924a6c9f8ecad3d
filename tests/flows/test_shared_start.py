"""Runs whose instants come from one stated start, or from a clock that was never set: each is a run of its own."""

from __future__ import annotations

import gzip
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import polars as pl
import pytest
import yaml

from kempf.flows.jobs.compare.compare_vessel import compare_vessel
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import Trial, simulate_trial, zigzag_settings
from kempf.warehouse.queries.comparable import comparable_sets
from kempf.warehouse.queries.deduplicate import once
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, segments
from kempf.warehouse.tables.segments import Segment
from tests.flows.content import fresh
from tests.warehouse.samples import segment
from tests.workbench.driving import kempf

#: a basin: repeated runs of one programme differ by little
STILL = Environment(wind_force=Disturbance(2e-4, 1e-4))
DAY_NS = 86_400_000_000_000


def trial(seed: int, days: int = 0) -> Trial:
    settings = zigzag_settings("mariner", duration_s=400.0, seed=seed, environment=STILL)
    return simulate_trial(replace(settings, start_utc_ns=settings.start_utc_ns + days * DAY_NS))


def elapsed(trial: Trial, decimals: int = 3) -> bytes:
    """The log with seconds since its start instead of UTC."""
    frame = pl.read_csv(io.BytesIO(gzip.decompress(to_csv(trial, 2.0))))
    at = pl.col("utc").str.to_datetime(time_unit="ms", time_zone="UTC").dt.epoch("ms") / 1000
    return frame.with_columns(utc=(at - trial.settings.start_utc_ns / 1e9).round(decimals)).write_csv().encode()


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    return tuple(trial(seed) for seed in (11, 12, 13))


def profile(trial: Trial, time: dict[str, Any]) -> str:
    content = logger_profile(trial.settings).model_dump(mode="json", exclude_defaults=True)
    content["sources"] = [{**content["sources"][0], "time": time}]
    return yaml.safe_dump(content)


def ingested(folder: Path, logs: dict[str, bytes], profile_text: str) -> tuple[Warehouse, list[dict[str, Any]]]:
    (folder / "profile.yaml").write_text(profile_text, encoding="utf-8")
    for name, data in logs.items():
        (folder / name).write_bytes(data)
    paths = [folder / name for name in logs]
    done = kempf("ingest", *paths, "--profile", folder / "profile.yaml", "--warehouse", folder / "w", "--json")
    assert done.code == 0, done
    return fresh(folder / "w"), done.json


@pytest.fixture(scope="module")
def tank(trials: tuple[Trial, ...], tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    """Three runs from one stated start; the first one was exported twice."""
    logs = {f"run_{k}.csv": elapsed(one) for k, one in enumerate(trials)}
    logs["run_0_again.csv"] = logs["run_0.csv"].replace(b".0,", b".00,") + b"\n"
    time = {"column": "utc", "unit": "s", "start": "2025-05-03T06:00:00Z"}
    return ingested(tmp_path_factory.mktemp("tank"), logs, profile(trials[0], time))[0]


def test_runs_of_one_stated_start_are_runs_of_their_own(tank: Warehouse) -> None:
    chosen = choose(tank, "mariner")
    names = sorted(chosen.file_names.values())
    assert len(chosen.segments) == 3 and {"run_1.csv", "run_2.csv"} < set(names)
    # to show that time alone would not do: they were put over at the same instants
    assert all(s.own_time is False for s in chosen.segments)
    assert len(once([replace(s, detail={}) for s in chosen.segments])[0]) == 1
    (why,) = chosen.skipped.values()
    assert "another log holds the same manoeuvre" in why


def test_they_are_pooled_and_compared_and_what_is_left_out_is_said(tank: Warehouse) -> None:
    done = kempf("identify", "--vessel", "mariner", "--warehouse", Path(tank.uri))
    assert "pooled" in done.out and "not in it: 1 manoeuvre, seg-" in done.out
    assert "another log holds the same manoeuvre, seg-" in done.out
    listed = kempf("identify", "--vessel", "mariner", "--warehouse", Path(tank.uri), "--json").json
    pooled = [one for one in listed if one["estimator"] == "ml-pooled"]
    assert len(pooled) == 1 and len(pooled[0]["segments"]) == 3
    stated = [one["not_pooled"] for one in listed if "not_pooled" in one]
    assert len(listed) == 5 and len(stated) == 1 and "another log" in stated[0]
    comparison = compare_vessel(tank, "mariner")
    assert len(comparison.runs) == 3 and len(comparison.skipped) == 1
    assert {run.held_out for run in comparison.runs} == {False, True}
    (kind,) = (one for one in comparable_sets(tank, "mariner") if one.estimator == "ml")
    assert len(kind.parameter_set_ids) == 3
    assert kind.left_out == {"of a manoeuvre that another log holds": 1}


def test_logs_of_1970_are_runs_of_their_own_and_listed(trials: tuple[Trial, ...], tmp_path: Path) -> None:
    logs = {f"run_{k}.csv": elapsed(one) for k, one in enumerate(trials[:2])}
    warehouse, documents = ingested(tmp_path, logs, profile(trials[0], {"column": "utc", "unit": "s"}))
    assert all(any("of 1970" in note for note in one["notes"]) for one in documents)
    found = segments.current(warehouse, "mariner")
    assert len(found) == 2 and len(choose(warehouse, "mariner").segments) == 2
    asked = ("--vessel", "mariner", "--warehouse", Path(warehouse.uri))
    assert kempf("identify", *asked).code == 0
    assert parameter_sets.summaries(warehouse, "mariner").height == 3
    assert "1970-01-01T00:0" in kempf("segments", *asked).out
    rows = kempf("history", *asked, "--json").json
    assert rows and all(row["start"].startswith("1970-01-01T00:0") for row in rows)
    assert kempf("history", *asked, "--changes").code == 0
    assert kempf("compare", *asked).code == 0
    assert kempf("reprocess", *asked).code == 0


def put_over(log: str, shift_s: float = 0.0, overshoots: tuple[float, ...] = (8.0, 9.0), **detail: Any) -> Segment:
    made = segment("aurora", log * 64, log, 10**18)
    executes = tuple(10**18 + round((20 + 60 * k + shift_s) * 1e9) for k in range(4))
    return replace(
        made,
        segment_id=f"seg-{log}",
        start_utc_ns=10**18,
        end_utc_ns=10**18 + 300 * 10**9,
        executes_utc_ns=executes,
        overshoots_deg=overshoots,
        detail=detail,
    )


@pytest.mark.parametrize(
    ("other", "twins"),
    [
        (put_over("b", 1.5, (7.0, 9.5)), True),
        (put_over("b", 2.5), False),
        (put_over("b", 1.5, own_time=False), True),
        (replace(put_over("b"), first_side="port"), False),
    ],
)
def test_where_a_log_has_its_own_time_the_executes_decide(other: Segment, twins: bool) -> None:
    kept, _ = once([put_over("a"), other])
    assert (len(kept) == 1) == twins


@pytest.mark.parametrize(
    ("other", "twins"),
    [
        (put_over("b", 0.03, (8.004, 9.0), own_time=False), True),
        (put_over("b", 0.5, own_time=False), False),
        (put_over("b", 0.0, (8.0, 9.02), own_time=False), False),
        (put_over("b", 0.0, (8.0,), own_time=False), False),
    ],
)
def test_where_none_has_what_was_measured_decides(other: Segment, twins: bool) -> None:
    kept, left = once([put_over("a", own_time=False), other])
    assert (len(kept) == 1) == twins == bool(left)


def ordered(log: str, turned_deg: float, largest_deg: float = 35.0) -> Segment:
    """A random manoeuvre by one programme of orders, run again."""
    made = put_over(log, 0.0, (), own_time=False, heading_range_deg=turned_deg)
    return replace(made, kind="random_manoeuvre", delta0_deg=largest_deg)


@pytest.mark.parametrize(
    ("other", "twins"),
    [
        (ordered("b", 141.203), True),
        (ordered("b", 141.3), False),
        (ordered("b", 141.2, 34.9), False),
        (put_over("b", 0.0, (), own_time=False), False),
    ],
)
def test_runs_of_one_programme_of_orders_are_told_apart_by_the_heading(other: Segment, twins: bool) -> None:
    kept, left = once([ordered("a", 141.2), other])
    assert (len(kept) == 1) == twins == bool(left)

"""A ship without a log, from her raw bytes to the parameter set and back: what is used, what is said, what is kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import yaml

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen, without_log
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel, inputs_of
from kempf.flows.jobs.identify.no_speed_log import KEY, estimate_of
from kempf.flows.jobs.identify.pool_vessel import pool_vessel, poolable
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.pipeline.estimate.no_log.identify import NoLogSettings
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, ZigzagTest
from kempf.pipeline.simulate.plant import STATE
from kempf.pipeline.simulate.trial import Trial, TrialSettings, simulate_trial, zigzag_settings
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, segments
from kempf.warehouse.tables.parameter_set import ParameterSet, parameter_set_id
from tests.flows.content import fresh
from tests.workbench.driving import kempf

STREAM_M_S = 0.5
#: a compass read as rarely as the rest makes the fits quick
INSTRUMENTS = tuple(replace(i, rate_hz=min(i.rate_hz, 1.0)) for i in DEFAULT_INSTRUMENTS if i.name != "log")


def blind(heading_deg: float, hours: float, seed: int) -> TrialSettings:
    """One zigzag in a stream towards north, some hours into the day."""
    base = zigzag_settings("mariner", seed=seed)
    return replace(
        base,
        programme=(SteadyCourse(120.0), ZigzagTest(20.0, 20.0, duration_s=500.0)),
        environment=Environment(wind_force=Disturbance(3e-3, 1e-3), current_north=Disturbance(STREAM_M_S)),
        instruments=INSTRUMENTS,
        heading_deg=heading_deg,
        start_utc_ns=base.start_utc_ns + round(hours * 3600e9),
    )


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    """Two zigzags on opposite headings within the hour, in two logs."""
    return tuple(simulate_trial(blind(*one)) for one in ((0.0, 0.0, 5), (180.0, 0.5, 6)))


@pytest.fixture(scope="module")
def folder(trials: tuple[Trial, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("blind")
    for number, trial in enumerate(trials):
        (folder / f"run{number}.csv.gz").write_bytes(to_csv(trial))
    profile = logger_profile(trials[0].settings).model_dump(mode="json", exclude_defaults=True)
    (folder / "profile.yaml").write_text(yaml.safe_dump(profile), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def filled(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Warehouse, Any]:
    """The warehouse that the command line filled, and what `kempf identify` said."""
    at = tmp_path_factory.mktemp("w") / "w"
    paths = [folder / "run0.csv.gz", folder / "run1.csv.gz"]
    done = kempf("ingest", *paths, "--profile", folder / "profile.yaml", "--warehouse", at)
    assert done.code == 0, done
    done = kempf("identify", "--vessel", "mariner", "--warehouse", at, "--json")
    assert done.code == 0, done
    return fresh(at), done.json


@pytest.fixture(scope="module")
def made(filled: tuple[Warehouse, Any]) -> tuple[ParameterSet, ...]:
    warehouse, _ = filled
    found = identify_vessel(warehouse, "mariner")
    assert not any(o.new for o in found), "the same request computes nothing again"
    return tuple(parameter_sets.get(warehouse, o.parameter_set.parameter_set_id) for o in found if o.parameter_set)


def test_the_speed_and_the_parameters_lie_within_their_errors(
    trials: tuple[Trial, ...], made: tuple[ParameterSet, ...]
) -> None:
    assert len(made) == 2
    for trial, one in zip(trials, made, strict=True):
        (bounds,) = one.provenance["inputs"]["segments"]
        start, end = ((bounds[f"{k}_utc_ns"] - trial.settings.start_utc_ns) / SECOND_NS for k in ("start", "end"))
        inside = np.arange(start, end)
        truth = float(np.mean(trial.truth.trajectory.at(inside).state[:, STATE.index("V")]))
        speed = one.convergence["speed"]
        assert abs(speed["mean_m_s"] - truth) < 3.0 * speed["std_m_s"] < 0.2
        # it is the speed over ground that would be off by the stream
        assert abs(speed["rounds"][0]["moved_m_s"]) > 0.6 * STREAM_M_S
        for p in one.parameters:
            assert p.std is not None and abs(p.value - getattr(trial.truth.parameters, p.name)) < 3.5 * p.std


def test_the_set_says_that_there_was_no_log(filled: tuple[Warehouse, Any], made: tuple[ParameterSet, ...]) -> None:
    for one in made:
        assert one.estimator == "ml" and one.convergence["converged"]
        assert any(w.startswith("no water log: speed") for w in one.warnings)
        assert any("known to 10 %" in w for w in one.warnings)
        settings = one.convergence["speed"]["settings"]
        assert settings["trial_speed_std_m_s"] == pytest.approx(0.1 * settings["trial_speed_m_s"])
        assert one.settings[KEY]["hull_misfit"] == NoLogSettings().hull_misfit
    shown = {s["parameter_set_id"] for s in filled[1]["segments"]} if "segments" in filled[1] else None
    assert shown is None or shown == {one.parameter_set_id for one in made}


def test_the_other_run_of_the_day_is_an_input(filled: tuple[Warehouse, Any], made: tuple[ParameterSet, ...]) -> None:
    warehouse, _ = filled
    first, second = segments.current(warehouse, "mariner")
    for one, own, other in zip(made, (first, second), (second, first), strict=True):
        inputs = one.provenance["inputs"]
        assert one.segment_ids == (own.segment_id,)
        assert [c["log_id"] for c in inputs["companions"]] == [other.log_id]
        assert set(one.log_ids) == {own.log_id, other.log_id}
        assert one.convergence["speed"]["runs"] == 2
        profile = one.provenance["profile_sha256"]
        assert one.parameter_set_id == parameter_set_id(inputs_of(own, profile, Request(), [other]))
        assert one.parameter_set_id != parameter_set_id(inputs_of(own, profile, Request()))
        moved = replace(other, end_utc_ns=other.end_utc_ns - 1)
        assert one.parameter_set_id != parameter_set_id(inputs_of(own, profile, Request(), [moved]))


def test_a_rerun_builds_the_same_bits(filled: tuple[Warehouse, Any], made: tuple[ParameterSet, ...]) -> None:
    done = kempf("rerun", made[0].parameter_set_id, "--warehouse", filled[0].uri, "--json")
    assert done.code == 0, done
    assert done.json["verdict"] == "bit-identical"


def test_nothing_is_pooled_with_the_speed_over_ground(filled: tuple[Warehouse, Any]) -> None:
    warehouse, _ = filled
    outcomes = identify_vessel(warehouse, "mariner")
    assert pool_vessel(warehouse, "mariner", Request(), outcomes) is None
    assert "no speed through the water" in str(poolable(warehouse, "mariner", Request(), outcomes))
    # the command says so of each, as text and as JSON
    assert all("no speed through the water" in one["not_pooled"] for one in filled[1])
    said = kempf("identify", "--vessel", "mariner", "--warehouse", Path(warehouse.uri))
    assert "not pooled: the manoeuvres have no speed through the water" in said.err
    still = Request(ModelSpec(current="none"))
    assert isinstance(poolable(warehouse, "mariner", still, outcomes), Chosen)
    assert all(without_log(segment) for segment in segments.current(warehouse, "mariner"))


def test_other_settings_of_the_speed_make_another_set(filled: tuple[Warehouse, Any]) -> None:
    one, _ = segments.current(filled[0], "mariner")
    wished = Request(no_log=(("trial_speed_m_s", 7.7), ("trial_speed_std_m_s", 0.1)))
    names = {parameter_set_id(inputs_of(one, "p", request)) for request in (Request(), wished)}
    assert len(names) == 2
    # the others do not estimate the speed, and their sets do not depend on how it would be done
    rival = Request(estimator="least-squares", no_log=wished.no_log)
    assert KEY not in inputs_of(one, "p", rival).settings
    logged = replace(one, detail={**one.detail, "has_log": True})
    assert KEY not in inputs_of(logged, "p", wished).settings


@pytest.mark.parametrize(("current", "refused"), [("earth", True), ("none", False)])
def test_an_engine_set_anew_is_refused_but_in_still_water(
    current: Literal["earth", "none"], refused: bool, filled: tuple[Warehouse, Any], trials: tuple[Trial, ...]
) -> None:
    warehouse, _ = filled
    segment = segments.current(warehouse, "mariner")[0]
    bounds = segment.start_utc_ns, segment.end_utc_ns
    read = channels_of(warehouse, segment.ingest_id)
    shaft = read.series["shaft_speed"]
    late = shaft.time_utc_ns > bounds[0] + 0.6 * (bounds[1] - bounds[0])
    anew = replace(shaft, value=np.where(late, 0.5, 1.0) * shaft.value)
    instruments = replace(read, series={**read.series, "shaft_speed": anew})
    spec = ModelSpec(current=current)
    asked = (make_record(instruments, *bounds), spec, 0.0, logger_profile(trials[0].settings))
    inputs = inputs_of(segment, "0" * 64, Request(spec=spec))
    if refused:
        with pytest.raises(DataRejected, match="rpm"):
            estimate_of(*asked, inputs, {segment.log_id: instruments})
    else:
        assert estimate_of(*asked, inputs, {segment.log_id: instruments}).parameters

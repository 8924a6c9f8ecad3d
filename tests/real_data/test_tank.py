"""Thirteen zigzags of a tanker model in the towing tank: angles, sides and overshoots that are known."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.identify.hsva import PUBLISHED
from benchmarks.measured_ships import ordered
from kempf.flows.jobs.identify.identify_vessel import Request, build, inputs_of
from kempf.flows.jobs.identify.parameter_set_of import SetRequest
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.pipeline.channels.instruments import from_readings
from kempf.warehouse.tables import readings
from tests.real_data.voyage import Voyage


def test_every_run_is_one_zigzag_with_the_angles_of_its_name(tank: Voyage) -> None:
    assert len(tank.outcomes) == 13
    for name, outcome in tank.outcomes.items():
        run = ordered(name)
        zigzags = [(s.kind, s.delta0_deg, s.psi0_deg, s.first_side) for s in outcome.segments]
        assert zigzags == [("zigzag", run.rudder_deg, run.heading_deg, run.side)], name


def test_nothing_is_lost(tank: Voyage) -> None:
    for name, outcome in tank.outcomes.items():
        assert outcome.outcome == "new", name
        assert outcome.tally is not None
        assert outcome.tally.records_rejected == 0, name
        assert outcome.tally.records_read == outcome.tally.records_kept > 1000, name


@pytest.mark.parametrize("run", sorted(PUBLISHED))
def test_overshoots_are_the_published_ones(tank: Voyage, run: str) -> None:
    (segment,) = next(o.segments for name, o in tank.outcomes.items() if run in name)
    for key, published in zip(("beyond_nominal_deg", "beyond_execute_deg"), PUBLISHED[run], strict=True):
        assert [o[key] for o in segment.detail["overshoots"]] == pytest.approx(published, abs=0.3)


def test_an_estimate_that_is_no_ship_says_so(tank: Voyage) -> None:
    """The default model lets wind and current explain what is ship: the set must not pass for a good one."""
    (segment,) = next(o.segments for name, o in tank.outcomes.items() if "Z_10_10_S" in name)
    profile = read_profiles(tank.ship.profiles)
    inputs = inputs_of(segment, profile.sha256, Request())
    instruments = from_readings(readings.read(tank.warehouse, segment.ingest_id))
    request = SetRequest(inputs, profile, tank.ship.name, (segment.segment_id,), {})
    made = build({segment.log_id: instruments}, request)
    values = np.array([p.value for p in made.parameters])
    plausible = bool(values[0] < 0 and values[3] < 0 and values[5] > 0)
    doubted = [w for w in made.warnings if "not converged" in w or "positive" in w or "not white" in w]
    assert np.all(np.isfinite(values))
    assert plausible or doubted
    assert made.convergence["converged"] or made.convergence["reason"]

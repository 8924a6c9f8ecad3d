"""A small unmanned vessel in open water: one 30/30 zigzag, its lateral speed, its parameters; a turning circle."""

from __future__ import annotations

import re

from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.warehouse.tables import parameter_sets
from tests.real_data.voyage import Voyage


def test_one_30_30_and_no_zigzag_in_the_turning_circle(boat: Voyage) -> None:
    zigzags = {name: [(s.kind, s.psi0_deg, s.delta0_deg) for s in o.segments] for name, o in boat.outcomes.items()}
    assert zigzags == {"turnningdata_xy.csv": [], "zigzag_30_inter_xy.csv": [("zigzag", 30.0, 30.0)]}


def test_no_row_is_lost(boat: Voyage) -> None:
    read = {name: (o.tally.records_read, o.tally.records_kept) for name, o in boat.outcomes.items() if o.tally}
    assert read == {"turnningdata_xy.csv": (174, 174), "zigzag_30_inter_xy.csv": (420, 420)}


def test_lateral_speed_comes_with_its_standard_error(boat: Voyage) -> None:
    (segment,) = boat.outcomes["zigzag_30_inter_xy.csv"].segments
    lateral = segment.detail["lateral_speed"]
    assert lateral["computed"] is True
    assert lateral["n"] > 0.9 * 420
    assert 0.0 < lateral["median_std_m_s"] < 0.05
    # she makes 0.5 to 0.7 m/s, so no lateral speed is larger
    assert 0.0 < lateral["rms_m_s"] < 0.7


def test_parameters_are_stored_with_what_speaks_against_them(boat: Voyage) -> None:
    (outcome,) = identify_vessel(boat.warehouse, boat.ship.name)
    assert outcome.error is None
    assert outcome.parameter_set is not None
    stored = parameter_sets.get(boat.warehouse, outcome.parameter_set.parameter_set_id)
    assert stored.as_json() == outcome.parameter_set.as_json()
    assert [p.name for p in stored.parameters] == ["a11", "a12", "a21", "a22", "b1", "b2"]
    assert all(p.std is not None and p.std > 0 for p in stored.parameters)
    assert stored.parameters[5].value > 0
    if abs(stored.fit["channels"]["heading"]["lag1_autocorrelation"]) > 0.3:
        assert any("not white" in warning for warning in stored.warnings)
    # the file's course was interpolated across north: what is left out as grossly wrong is counted, nothing vanishes
    left_out = stored.convergence["gross_errors"].get("lateral_speed", 0)
    lateral = stored.fit["channels"]["lateral_speed"]
    assert lateral["settling"] < 20
    warnings = "\n".join(stored.warnings)
    before = re.search(r"^(\d+) gross errors of lateral_speed left out before the fit", warnings, re.MULTILINE)
    assert before is not None
    assert lateral["n"] + lateral["settling"] + left_out + int(before[1]) == 420
    assert int(before[1]) >= 10
    assert any("gross errors of lateral_speed" in warning for warning in stored.warnings)

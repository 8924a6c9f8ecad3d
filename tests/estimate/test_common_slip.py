"""The race goes with the shaft speed: one ratio for all runs of a vessel, whatever speed a run begins with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.record.grid_run import GridRun, with_common_slip
from kempf.pipeline.estimate.record.rudder_inflow import approach_speed
from kempf.schemas.symbols import CHANNEL_SYMBOLS
from tests.diagnose.sailing import sailed

SHAFT = 2 + list(CHANNEL_SYMBOLS).index("n")


def run_of(speed_m_s: float, shaft_per_s: float, name: str) -> GridRun:
    """A run that begins at a speed and comes to the one that its shaft keeps, 4 m a turn."""
    whole = sailed().runs[0]
    n = whole.inputs.shape[0]
    inputs = whole.inputs.copy()
    kept = 4.0 * shaft_per_s
    inputs[:, 0] = kept + (speed_m_s - kept) * np.exp(-np.arange(n) / (0.1 * n))
    inputs[:, SHAFT] = shaft_per_s
    channels = whole.channels | {"shaft_speed"}
    return replace(
        whole, name=name, inputs=inputs, approach_m_s=speed_m_s, approach_per_s=shaft_per_s, channels=channels
    )


def test_a_run_that_begins_slow_has_the_race_of_its_shaft() -> None:
    settled, slow, other = run_of(8.0, 2.0, "a"), run_of(6.5, 2.0, "b"), run_of(6.0, 1.5, "c")
    for run, was in zip(with_common_slip([settled, slow, other]), (settled, slow, other), strict=True):
        race = run.approach_m_s * run.inputs[::ROWS, SHAFT] / run.approach_per_s
        assert race == pytest.approx(4.0 * was.inputs[::ROWS, SHAFT], rel=0.01)
        assert run.approach_m_s == was.approach_m_s
        # effects take for V0 what the shaft keeps, the rudder's power of V goes by the approach
        V0, n0, _, approach = run.constants(1.0)[3:]
        assert [V0, n0] == pytest.approx([4.0 * n0, was.approach_per_s], rel=0.01)
        assert approach == was.approach_m_s


def test_runs_without_a_shaft_speed_stay_as_they_are() -> None:
    whole = sailed().runs[0]
    without = replace(whole, channels=whole.channels - {"shaft_speed"})
    assert with_common_slip([without]) == (without,)
    assert without.shaft_per_s is None
    assert without.settled_m_s == without.approach_m_s
    assert without.constants(2.0)[3:].tolist() == [
        without.approach_m_s,
        without.approach_per_s,
        2.0,
        without.approach_m_s,
    ]


def test_the_approach_of_a_run_from_rest_is_the_speed_that_it_comes_to() -> None:
    time = np.arange(200.0)
    assert approach_speed(time, 8.0 - 0.01 * time) == pytest.approx(8.0, abs=0.05)
    # out of a turn, or amid a random manoeuvre
    assert approach_speed(time, 8.0 - 3.0 * np.exp(-time / 40.0)) == pytest.approx(8.0, rel=0.03)
    assert approach_speed(time, 0.4 * (1.0 - np.exp(-time / 40.0))) == pytest.approx(0.4, rel=0.03)

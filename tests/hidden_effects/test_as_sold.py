"""What instruments as they are sold do to readings, against what is asked of each."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.diagnose.hidden_effects.as_sold import as_sold
from kempf.pipeline.simulate.instruments import Instrument, InstrumentRecord
from kempf.schemas.units import SECOND_NS


def record(name: str, values: dict[str, np.ndarray], rate_hz: float = 1.0) -> InstrumentRecord:
    n = next(iter(values.values())).size
    instants = np.round(np.arange(n) / rate_hz * SECOND_NS).astype(np.int64)
    return InstrumentRecord(Instrument(name, rate_hz, 0.0), instants, instants, values)


def test_a_receiver_is_late_by_its_time_constant_and_its_noise_remembers() -> None:
    time = np.arange(20000.0) / 10.0
    speed, course = 8.0 + 0.5 * np.sin(0.02 * time), np.full(time.size, 1.0)
    clean = record("gnss", {"speed_over_ground_m_s": speed, "course_over_ground_rad": course}, 10.0)
    found = as_sold(clean, clean, quick=False).values["speed_over_ground_m_s"]
    # slow motion comes through a first-order filter later by its time constant
    assert np.allclose(found[200:], 8.0 + 0.5 * np.sin(0.02 * (time[200:] - 0.8)), atol=2e-3)
    noise = np.random.default_rng(1).normal(0.0, 0.05, time.size)
    noisy = record("gnss", {"speed_over_ground_m_s": speed + noise, "course_over_ground_rad": course}, 10.0)
    left = as_sold(noisy, clean, quick=False).values["speed_over_ground_m_s"] - found
    left = left[500:]
    # a second later, a first-order process of 5 s behind a filter of 0.8 s
    kept = (5.0 * np.exp(-1.0 / 5.0) - 0.8 * np.exp(-1.0 / 0.8)) / (5.0 - 0.8)
    assert np.mean(left[10:] * left[:-10]) / np.mean(left**2) == pytest.approx(kept, abs=0.02)


def test_a_log_averages_a_rudder_is_off_and_a_compass_stays_a_compass() -> None:
    steps = np.where(np.arange(100) < 50, 0.0, 1.0)
    log = record("log", {"speed_through_water_m_s": steps})
    found = as_sold(log, log, quick=False).values["speed_through_water_m_s"]
    assert np.allclose(found[48:56], [0.0, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0])
    rudder = record("rudder", {"rudder_angle_rad": steps})
    assert np.allclose(as_sold(rudder, rudder, quick=True).values["rudder_angle_rad"], 1.02 * steps)
    turning = np.mod(np.linspace(6.0, 7.0, 300), 2.0 * np.pi)
    noise = np.random.default_rng(2).normal(0.0, 1e-3, 300)
    seen = record("heading", {"heading_rad": np.mod(turning + noise, 2.0 * np.pi)})
    heading = as_sold(seen, record("heading", {"heading_rad": turning}), quick=False).values["heading_rad"]
    assert np.all((heading >= 0.0) & (heading < 2.0 * np.pi))
    off = np.mod(heading - turning + np.pi, 2.0 * np.pi) - np.pi
    assert 0.5e-3 < float(np.std(off)) < 1.5e-3

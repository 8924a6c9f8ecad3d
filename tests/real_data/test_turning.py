"""Measured turning circles: six of a model on a pond with her positions beside, one of a small vessel at sea."""

from __future__ import annotations

import gzip
from io import BytesIO

import numpy as np
import polars as pl
import pytest

from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.warehouse.tables import segments
from tests.real_data.voyage import SHARED, Voyage

#: Rudder and side of each, and when its rudder was put over, s, as the columns show.
CIRCLES = {
    "turn_14-Oct-2020_14_08_51.csv.gz": (35.0, "starboard", 199.9),
    "turn_14-Oct-2020_14_29_49.csv.gz": (20.0, "starboard", 109.9),
    "turn_14-Oct-2020_14_56_07.csv.gz": (20.0, "port", 109.9),
    "turn_14-Sep-2020_13_39_32.csv.gz": (35.0, "starboard", 119.9),
    "turn_14-Sep-2020_14_16_04.csv.gz": (35.0, "port", 119.9),
    "turn_14-Sep-2020_14_50_41.csv.gz": (35.0, "starboard", 159.9),
}


def by_hand(name: str, execute_s: float) -> dict[str, float]:
    """Advance, transfer and tactical diameter from the positions that the profile leaves out, rate from the gyro."""
    raw = (SHARED / "data" / "esso_osaka" / name).read_bytes()
    log = pl.read_csv(BytesIO(gzip.decompress(raw)))
    time, heading = log["t [s]"].to_numpy(), np.unwrap(log["psi_hat [rad]"].to_numpy())
    begin = int(np.searchsorted(time, execute_s))
    course = float(np.mean(heading[begin - 100 : begin]))
    turned = np.abs(heading[begin:] - course)
    north, east = (log[f"{axis}_position_mid [m]"].to_numpy()[begin:] for axis in "xy")
    track = ((north - north[0]) + 1j * (east - east[0])) * np.exp(-1j * course)
    quarter, half = (track[int(np.argmax(turned >= angle))] for angle in (np.pi / 2, np.pi))
    held = np.abs(log["delta_rudder [rad]"].to_numpy()[begin:]) > 0.3
    whole = held & (turned > np.max(turned[held]) - 2.0 * np.pi) & (np.max(turned[held]) >= 3.0 * np.pi)
    rate = np.mean(log["r_angvelo [rad/s]"].to_numpy()[begin:][whole]) if whole.any() else np.nan
    return {
        "advance_m": float(quarter.real),
        "transfer_m": float(abs(quarter.imag)),
        "tactical_diameter_m": float(abs(half.imag)),
        "steady_yaw_rate_deg_s": float(np.rad2deg(rate)),
    }


@pytest.mark.parametrize("name", CIRCLES)
def test_every_circle_is_found_with_the_figures_of_its_positions(pond: Voyage, name: str) -> None:
    rudder, side, execute_s = CIRCLES[name]
    outcome = pond.outcomes[name]
    assert outcome.segments == ()
    (circle,) = outcome.others
    assert (circle.kind, circle.delta0_deg, circle.first_side) == ("turning_circle", rudder, side)
    (execute,) = circle.executes_utc_ns
    start = np.datetime64("2020-07-31T00:00:00", "ns").astype(np.int64)
    assert (execute - start) / 1e9 == pytest.approx(execute_s, abs=0.3)
    figures, measured = circle.detail["figures"], by_hand(name, execute_s)
    assert circle.detail["track"] == "speed and course over ground"
    # her velocities and her positions, of two filters, differ by 3 % in the advance
    for figure, tolerance in (("advance_m", 0.045), ("transfer_m", 0.07), ("tactical_diameter_m", 0.02)):
        found = figures[figure]
        assert found["value"] == pytest.approx(measured[figure], rel=tolerance), figure
        assert found["low"] - 0.03 * found["value"] < measured[figure] < found["high"] + 0.03 * found["value"], figure
    if np.isfinite(measured["steady_yaw_rate_deg_s"]):
        assert figures["steady_yaw_rate_deg_s"]["value"] == pytest.approx(measured["steady_yaw_rate_deg_s"], rel=0.02)
    assert 5.0 < figures["steady_drift_deg"]["value"] < 30.0
    assert 25.0 < figures["speed_loss_percent"]["value"] < 70.0
    # in wind she drifts, and no log says that it is the water
    assert circle.detail["corrected_for_current"] is False


def test_nothing_else_is_found_on_the_pond(pond: Voyage) -> None:
    others = {name: [s.kind for s in o.others] for name, o in pond.outcomes.items() if name not in CIRCLES}
    assert set(map(tuple, others.values())) == {()}
    fitted = segments.current(pond.warehouse, pond.ship.name)
    names = {o.log_id: name for name, o in pond.outcomes.items()}
    for one in fitted:
        named = names[one.log_id].partition("_")[0]
        assert one.kind == {"zigzag": "zigzag", "random": "random_manoeuvre"}[named]
    assert len(segments.every(pond.warehouse, pond.ship.name)) == len(fitted) + len(CIRCLES)


def test_random_runs_are_found_where_she_goes_ahead(pond: Voyage) -> None:
    irregular = [s for s in segments.current(pond.warehouse, pond.ship.name) if s.kind == "random_manoeuvre"]
    assert len(irregular) == 4 and len({s.log_id for s in irregular}) == 2
    for one in irregular:
        channels = channels_of(pond.warehouse, one.ingest_id)
        along = channels.series["speed_over_ground"].between(one.start_utc_ns, one.end_utc_ns).value
        shaft = channels.series["shaft_speed"].between(one.start_utc_ns, one.end_utc_ns).value
        assert along.min() > 0.05 and shaft.min() > -0.5
        assert len(one.executes_utc_ns) >= 6 and one.delta0_deg == pytest.approx(35.0, abs=0.5)


def test_zigzags_in_the_tank_are_zigzags_only(tank: Voyage) -> None:
    assert all(outcome.others == () for outcome in tank.outcomes.values())
    assert sum(len(outcome.segments) for outcome in tank.outcomes.values()) == 13


def test_the_small_vessel_turned_once_from_an_approach_that_is_not_there(boat: Voyage) -> None:
    assert boat.outcomes["zigzag_30_inter_xy.csv"].others == ()
    (circle,) = boat.outcomes["turnningdata_xy.csv"].others
    assert (circle.kind, circle.first_side) == ("turning_circle", "starboard")
    assert circle.delta0_deg == pytest.approx(22.0, abs=1.0)
    assert circle.quality["start"] == "unknown"
    figures = circle.detail["figures"]
    assert figures["speed_loss_percent"]["value"] is None
    assert "approach" in figures["speed_loss_percent"]["why"]
    # 0.88 kn at a turn in 80 s
    assert figures["steady_yaw_rate_deg_s"]["value"] == pytest.approx(4.5, abs=0.2)
    assert figures["steady_diameter_m"]["value"] == pytest.approx(2 * 0.453 / np.deg2rad(4.5), rel=0.05)
    assert figures["steady_diameter_of_track_m"]["value"] == pytest.approx(
        figures["steady_diameter_m"]["value"], rel=0.1
    )

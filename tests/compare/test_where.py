"""Where a model fails: nothing is said of the true one, and what is put in is found where it was put."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from kempf.pipeline.compare.correlations import correlations
from kempf.pipeline.compare.group import rms_band
from kempf.pipeline.compare.misfit import where
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.predict.run_residuals import PhaseInterval, RunResiduals
from tests.compare.seen import NOISE, QUIET, looked_at, run_of, sailed_by_model
from tests.estimate.simulated import sailed, truth_of

TRIAL = sailed("mariner", seed=3, duration_s=900.0)
HULL = truth_of(TRIAL)
RUN = run_of(TRIAL, QUIET)


def phases() -> tuple[PhaseInterval, ...]:
    """While the rudder moves it is execute, else the time after it."""
    rate = np.abs(np.gradient(RUN.rudder_rad, RUN.step_s))
    moving = rate > 0.2 * rate.max()
    edges = np.flatnonzero(np.diff(moving.astype(int))) + 1
    bounds = [0, *edges.tolist(), moving.size]
    return tuple(
        PhaseInterval("execute" if moving[a] else "steady_yaw", a * RUN.step_s, b * RUN.step_s)
        for a, b in pairwise(bounds)
    )


def looked(seed: int = 1, late_s: float = 0.0, name: str = "seg-1") -> RunResiduals:
    return looked_at(sailed_by_model(replace(RUN, name=name), HULL, seed=seed, late_s=late_s), HULL, phases())


def every_group(found: dict) -> list[dict]:
    named = [one for of in ("by_phase", "by_side", "by_run") for one in found[of].values()]
    return named + [one for bins in found["by_bin"].values() for one in bins]


def test_the_true_model_is_white_everywhere() -> None:
    found = where([looked(seed, name=f"seg-{seed}") for seed in (1, 2, 3)])
    json.dumps(found, allow_nan=False)
    assert found["stands_out"] == []
    groups = every_group(found)
    assert set(found["by_run"]) == {"seg-1", "seg-2", "seg-3"}
    for one in groups:
        assert {"n", "whitened_rms", "band", "outside", "channels"} == set(one) - {"low", "high", "unit"}
        assert one["n"] == sum(c["n"] for c in one["channels"].values())
    # bands hold 99 % each: among so many groups that share data a few may lie outside
    assert sum(one["outside"] for one in groups) <= 0.1 * len(groups)
    for run in found["by_run"].values():
        assert run["whitened_rms"] == pytest.approx(1.0, abs=0.06)
        assert run["channels"]["yaw_rate"]["free_run_rms"] == pytest.approx(np.rad2deg(NOISE[1]), rel=0.15)
    for channel in found["correlations"].values():
        assert channel["auto"]["p_value"] > 1e-3
        assert channel["auto"]["outside"] <= 6
        assert all(cross["p_adjusted"] > 1e-3 for cross in channel["cross"].values())
    outside = [band["outside"] for bands in found["by_band"].values() for band in bands]
    assert sum(outside) <= 3


def test_groups_of_one_kind_hold_every_instant_once() -> None:
    one = looked()
    found = where([one])
    whole = int(np.isfinite(one.whitened).sum())
    assert sum(g["n"] for g in found["by_side"].values()) == whole
    for bins in found["by_bin"].values():
        assert sum(g["n"] for g in bins) == whole
    assert sum(g["n"] for g in found["by_phase"].values()) == whole


def test_a_rudder_that_answers_2_s_late_shows_while_it_moves_and_against_the_rudder() -> None:
    found = where([looked(seed, late_s=2.0, name=f"seg-{seed}") for seed in (1, 2)])
    execute, steady = found["by_phase"]["execute"], found["by_phase"]["steady_yaw"]
    assert execute["channels"]["yaw_rate"]["outside"]
    assert execute["channels"]["yaw_rate"]["whitened_rms"] > steady["channels"]["yaw_rate"]["whitened_rms"]
    assert any(s["of"] == "by_phase" and s["which"] == "execute" for s in found["stands_out"])
    cross = found["correlations"]["yaw_rate"]["cross"]["rudder_rate"]
    assert cross["outside"] > 5 * cross["expected_outside"]
    assert abs(cross["largest"]) > 3.0 * cross["band"]
    assert cross["p_adjusted"] < 1e-6
    # b2 is positive, and the late rudder's yaw acceleration is missing while it moves to starboard
    assert cross["largest"] < 0.0 and cross["largest_lag_s"] <= 6.0
    # the worst windows lie where the rudder moves
    first = [w for w in found["worst"] if w["measure"] == "one step"]
    assert first and all(w["p_value"] < 0.01 for w in first)


def test_a_ripple_of_a_tenth_of_a_hertz_is_found_in_its_band() -> None:
    base = sailed_by_model(RUN, HULL)
    measured = base.run.measured.copy()
    measured[:, 1] += NOISE[1] * np.sin(2.0 * np.pi * 0.1 * RUN.time_s)
    found = where([looked_at(replace(base, run=replace(base.run, measured=measured)), HULL)])
    bands = {band["low_hz"]: band for band in found["by_band"]["yaw_rate"]}
    (rippled,) = [band for band in bands.values() if band["low_hz"] <= 0.1 < band["high_hz"]]
    assert rippled["outside"] and rippled["ratio"] > 1.5
    assert rippled["peak_hz"] == pytest.approx(0.1, abs=0.002)
    assert all(not band["outside"] or band["ratio"] < 1.0 for band in bands.values() if band is not rippled)
    # the filter carries some of it into the heading, at the same frequency, and nothing into the lateral speed
    assert not any(band["outside"] and band["ratio"] > 1.3 for band in found["by_band"]["lateral_speed"])


def test_the_bands_add_up_to_the_error_of_the_free_run() -> None:
    one = looked(late_s=2.0)
    found = where([one])
    for i, name in enumerate(("lateral_speed", "yaw_rate", "heading")):
        e = one.free.error[:, i] - one.free.error[:, i].mean()
        factor = 1.0 if i == 0 else np.rad2deg(1.0)
        total = np.sqrt(sum(band["free_run_rms"] ** 2 for band in found["by_band"][name]))
        assert total == pytest.approx(factor * np.sqrt(np.mean(e**2)), rel=0.02)


def test_the_worst_stretch_is_where_it_was_put() -> None:
    base = sailed_by_model(RUN, HULL)
    measured = base.run.measured.copy()
    k = measured.shape[0] // 2
    measured[k : k + 15, 0] += 4.0 * NOISE[0] * np.resize([1.0, -1.0], 15)
    found = where([looked_at(replace(base, run=replace(base.run, measured=measured)), HULL)])
    first = found["worst"][0]
    assert (first["channel"], first["measure"]) == ("lateral_speed", "one step")
    assert first["start_s"] <= k * RUN.step_s <= first["end_s"] + RUN.step_s
    assert first["start"].endswith("Z") and first["start"] < first["end"]


@pytest.mark.parametrize("n", [1, 10, 1000])
def test_the_band_holds_99_percent(n: int) -> None:
    rms = np.sqrt(np.mean(np.random.default_rng(n).standard_normal((20000, n if n < 1000 else 200)) ** 2, axis=1))
    low, high = rms_band(n if n < 1000 else 200)
    assert np.mean((rms >= low) & (rms <= high)) == pytest.approx(0.99, abs=0.004)


def test_a_window_that_is_asked_for_again_holds_all_its_instants() -> None:
    # a log whose instants lie between milliseconds
    odd = replace(RUN, start_utc_ns=RUN.start_utc_ns + 613_457)
    filtered = sailed_by_model(odd, HULL, seed=1, late_s=4 * RUN.step_s)
    for one in where([looked_at(filtered, HULL, phases())])["worst"]:
        begin, end = (np.datetime64(one[key][:-1], "ns").astype(np.int64) for key in ("start", "end"))
        instants = odd.start_utc_ns + np.round(odd.time_s * 1e9).astype(np.int64)
        assert np.count_nonzero((instants >= begin) & (instants <= end)) == 24


def test_a_run_shorter_than_the_longest_lag_counts_where_it_has_pairs() -> None:
    n = 30
    fine = slice(ROWS * (n - 1) + 1)
    cut = {
        name: getattr(RUN, name)[:n] for name in ("rudder_noise", "measured", "offset_s", "current_row", "heading_rad")
    }
    short = replace(RUN, name="short", inputs=RUN.inputs[fine], **cut)
    one, other = looked(2), looked_at(sailed_by_model(short, HULL), HULL)
    assert one.filtered.run.step_s * n < 60.0
    alone, both = (correlations(runs)["yaw_rate"]["auto"] for runs in ([one], [one, other]))
    assert both["lag_s"] == alone["lag_s"] and both["rho"][0] != alone["rho"][0]
    assert both["rho"][-1] == alone["rho"][-1], "beyond its end it has none"

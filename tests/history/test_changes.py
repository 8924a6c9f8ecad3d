"""Changes that are known: found where they are, in what they are, or not reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.history.changes import Changes, find_changes
from kempf.pipeline.history.scan import judge, stretch
from kempf.pipeline.history.sets import ParameterHistory, occasions, usable
from kempf.pipeline.history.settings import ChangeSettings
from kempf.schemas.errors import DataRejected
from tests.history.made import DAY_NS, NAMES, START_NS, TRUTH, history, step

#: Enough for what is tested here.
QUICK = ChangeSettings(draws=199)


def found_in(h: ParameterHistory, **changes: float) -> Changes:
    return find_changes(h, replace(QUICK, **changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(("scatter", "worse"), [(0.0, 1.0), (0.0, 1.3), (0.03, 1.0)])
def test_nothing_is_reported_of_a_ship_that_did_not_change(scatter: float, worse: float) -> None:
    alarms = 0
    for seed in range(60):
        one = stretch(history(12, scatter=scatter, worse=worse, seed=seed), QUICK)
        alarms += judge(one, QUICK.level).p_value <= QUICK.level
    assert alarms <= 8  # 3 expected at the level; 9 or more of 60 have probability 0.3 % there


def test_a_new_rudder_is_a_step_with_its_date_and_size() -> None:
    h = history(24, shift=step(24, 14, b1=0.08, b2=0.06))
    found = found_in(h)
    assert found.verdict == "step"
    (change,) = found.changes
    assert change.kind == "step"
    low, high = change.interval_utc_ns
    assert low <= h.time_utc_ns[13] and h.time_utc_ns[14] <= high
    assert high - low <= 6 * 30 * DAY_NS
    truth = step(24, 14, b1=0.08, b2=0.06)[-1] * TRUTH
    assert np.all(np.abs(change.change - truth) <= change.width * change.std)
    assert change.moved[NAMES.index("b2")]
    assert not np.any(change.moved & (truth == 0))
    assert change.before == pytest.approx(TRUTH, rel=0.1)
    assert change.p_value <= 0.05
    assert change.rival > 2


def test_what_one_parameter_alone_explains_is_said() -> None:
    found = found_in(history(20, shift=step(20, 10, a22=0.06)))
    (change,) = found.changes
    by = {NAMES[j]: (size, std) for j, size, std in change.alone}
    size, std = by["a22"]
    assert abs(size - 0.06 * TRUTH[3]) < 3 * std
    assert abs(size) > 4 * std
    assert std < change.std[3]  # who knows that nothing else changed knows more
    assert "b2" not in by


def test_fouling_is_a_drift_with_its_rate() -> None:
    n = 24
    years = np.arange(n) * 30 / 365.25
    h = history(n, shift=np.outer(years, [0.08, 0, 0, 0.08, 0, 0]))
    found = found_in(h)
    assert found.verdict == "drift"
    (change,) = found.changes
    truth = TRUTH * np.array([0.08, 0, 0, 0.08, 0, 0])
    assert np.all(np.abs(change.change - truth) <= change.width * change.std)
    assert change.interval_utc_ns == (int(h.time_utc_ns[0]), int(h.time_utc_ns[-1]))


def test_two_steps_are_both_found() -> None:
    n = 36
    h = history(n, shift=step(n, 12, b2=0.08) - step(n, 26, b2=0.08))
    found = found_in(h)
    assert found.verdict == "steps"
    assert [h.time_utc_ns.tolist().index(c.between_utc_ns[1]) for c in found.changes] == [12, 26]
    for change, size in zip(found.changes, (0.08, -0.08), strict=True):
        # fitted between its neighbours: the other step is not in it
        assert abs(change.change[5] - size * TRUTH[5]) <= change.width * change.std[5]


def test_fouling_and_a_docking_are_told_apart() -> None:
    n, docked = 30, 18
    years = np.arange(n) * 30 / 365.25
    fouled = np.outer(np.where(np.arange(n) < docked, years, 0.0), [0.08, 0, 0, 0.08, 0, 0])
    h = history(n, shift=fouled)
    found = found_in(h)
    assert found.verdict == "step and drift"
    drift, cleaned = found.changes
    assert (drift.kind, cleaned.kind) == ("drift", "step")
    assert cleaned.between_utc_ns[1] == h.time_utc_ns[docked]
    truth = -fouled[docked - 1] * TRUTH
    # from the end of the line, not from its middle
    assert np.all(np.abs(cleaned.change - truth) <= cleaned.width * cleaned.std)
    assert cleaned.moved[NAMES.index("a22")]


def test_no_change_says_what_would_have_been_seen_and_keeps_its_word() -> None:
    seen = []
    for seed in range(8):
        found = found_in(history(12, seed=seed))
        assert found.verdict == "no change seen"
        assert np.all(found.smallest > 0)
        shift = step(12, 6, b2=float(found.smallest[5] / TRUTH[5]))
        others = (stretch(history(12, shift=shift, seed=100 * seed + k), QUICK) for k in range(100, 108))
        seen += [judge(one, QUICK.level).p_value <= QUICK.level for one in others]
    # 0.9 on average over the histories that the promise is made from; three binomial standard deviations below
    assert np.mean(seen) > 0.9 - 3 * np.sqrt(0.09 / len(seen))


def test_more_sets_see_smaller_changes() -> None:
    few, many = (found_in(history(n, seed=2)).smallest for n in (8, 40))
    assert np.all(many < few)


@pytest.mark.parametrize("n", [0, 1, 3])
def test_too_few_are_not_tested(n: int) -> None:
    found = found_in(history(n))
    assert found.verdict == "not testable with these data"
    assert "at least 4 occasions are needed" in found.why
    assert found.changes == ()
    assert np.isnan(found.p_value)


def test_trials_of_one_day_are_one_occasion() -> None:
    h = history(6, apart_days=0.1)
    assert found_in(h).verdict == "not testable with these data"
    assert len(occasions(h, 12 * 3600.0)) == 1
    assert len(occasions(h, 0.25 * 86400.0)) == 2  # 0, 0.1, 0.2 and 0.3, 0.4, 0.5 days
    assert len(occasions(h, 0.0)) == 6
    assert found_in(h, occasion_s=0.0).verdict != "not testable with these data"
    instant = ParameterHistory(h.names, h.units, np.full(6, START_NS), h.value, h.covariance)
    assert found_in(instant, occasion_s=0.0).verdict == "not testable with these data"


def test_an_occasion_is_the_mean_of_its_sets() -> None:
    h = history(2, apart_days=0.1)
    merged = occasions(h, 12 * 3600.0)
    inside = np.sort(h.value, axis=0)
    assert np.all((inside[0] <= merged.value[0]) & (merged.value[0] <= inside[1]))
    S = h.covariance[0]
    same = ParameterHistory(h.names, h.units, h.time_utc_ns, h.value, np.array([S, S]))
    merged = occasions(same, 12 * 3600.0)
    assert merged.value[0] == pytest.approx(np.mean(h.value, axis=0))
    assert merged.covariance[0] == pytest.approx(S / 2)


def test_one_bad_trial_at_the_end_is_no_step() -> None:
    h = history(12, shift=step(12, 11, b2=0.3, a22=0.3))
    assert all(c.between_utc_ns[1] != h.time_utc_ns[11] for c in found_in(h).changes)


def test_units_do_not_matter() -> None:
    h = history(14, shift=step(14, 7, b2=0.06))
    factor = np.array([1e3, 2.0, -1e6, 1.0, 1e-3, 1e5])
    other = ParameterHistory(h.names, h.units, h.time_utc_ns, h.value * factor, h.covariance * np.outer(factor, factor))
    one, two = found_in(h), found_in(other)
    assert one.verdict == two.verdict
    assert two.changes[0].change == pytest.approx(one.changes[0].change * factor, rel=1e-6)
    assert two.changes[0].std == pytest.approx(one.changes[0].std * np.abs(factor), rel=1e-6)


def test_equal_histories_give_equal_bits() -> None:
    one, two = (found_in(history(10, shift=step(10, 5, b2=0.06))) for _ in range(2))
    assert one.p_value == two.p_value
    assert one.smallest.tobytes() == two.smallest.tobytes()
    assert one.changes[0].width == two.changes[0].width


def test_a_history_must_be_whole() -> None:
    h = history(4)
    bad = h.covariance.copy()
    bad[2] = np.nan
    assert usable(h.value, bad).tolist() == [True, True, False, True]
    for code, time, value, covariance in (
        ("covariance_unusable", h.time_utc_ns, h.value, bad),
        ("history_not_in_order", h.time_utc_ns[::-1], h.value, h.covariance),
        ("history_shape", h.time_utc_ns, h.value[:3], h.covariance),
    ):
        with pytest.raises(DataRejected) as caught:
            ParameterHistory(h.names, h.units, time, value, covariance)
        assert caught.value.code == code

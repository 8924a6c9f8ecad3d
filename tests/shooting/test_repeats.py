"""How much of what a model leaves is noise, and where it sits, on ships that sail the same zigzags again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.diagnose.verdicts.remaining_misfit import RemainingMisfit, remaining_misfit, said
from kempf.pipeline.shooting.ahead import Ahead, shooting_range
from kempf.pipeline.shooting.places import Places, places
from kempf.pipeline.shooting.repeats import FEWEST_PAIRS, Repeats, _summed, repeats
from kempf.schemas import effects
from tests.diagnose.sailing import WORKERS, Sailed, repeated, sailed


def plain(ship: Sailed, fitted: int) -> Ahead:
    return shooting_range(ship.runs[:fitted], ship.runs[fitted:], ship.spec, WORKERS).plain


def noise(ahead: Ahead) -> Repeats:
    return repeats(ahead.fit, ahead.held_windows, ahead.horizon_s, WORKERS)


def test_of_a_ship_without_an_effect_nearly_all_that_is_left_is_noise() -> None:
    found = noise(plain(repeated(), 6))
    assert found.share is not None and found.std is not None
    assert found.pairs > 50 and found.manoeuvres == 8
    assert found.std < 0.15 and abs(found.share - 1.0) < max(2.5 * found.std, 0.1)


@pytest.mark.parametrize("outsider", ["yaw_hysteresis", "kick_at_executes"])
def test_of_a_ship_with_what_no_catalogue_names_it_is_not(outsider: str) -> None:
    found = noise(plain(repeated(outsider), 6))
    assert found.share is not None and found.std is not None
    assert found.share + 3.0 * found.std < 0.8


def test_once_the_effect_is_included_what_is_left_is_noise() -> None:
    ship = repeated("cross_flow_drag")
    shooting = shooting_range(ship.runs[:6], ship.runs[6:], ship.spec, WORKERS)
    after = shooting.with_effect(shooting.plain, effects.get("cross_flow_drag"))
    assert after is not None
    before, found = noise(shooting.plain), noise(after)
    assert before.share is not None and before.share < 0.7
    assert found.share is not None and found.std is not None and abs(found.share - 1.0) < max(3.0 * found.std, 0.15)
    # the noise is that of the experiment, whichever model it is seen with
    assert found.share * found.misfit == pytest.approx(before.share * before.misfit, rel=0.35)


def test_zigzags_on_other_headings_do_not_repeat_each_other() -> None:
    ship = sailed("none")
    ahead = plain(ship, 3)
    found = noise(ahead)
    assert found.share is None and found.std is None and found.pairs < FEWEST_PAIRS
    remaining = remaining_misfit(ahead, WORKERS)
    assert remaining is not None
    (first, second) = said(remaining, "the misfit")
    assert first.startswith("How much of the misfit is noise of the experiment is not known: ")
    assert second.startswith("The misfit is largest in ")


def test_the_same_bits_twice() -> None:
    ahead = plain(repeated(), 6)
    assert noise(ahead) == noise(ahead)


def test_the_share_is_read_off_at_distance_nothing() -> None:
    random = np.random.default_rng(1)
    pairs = np.array([(i, j) for i in range(8) for j in range(i)], dtype=np.float64)
    apart = random.uniform(0.0, 0.09, pairs.shape[0])
    misfit = random.uniform(0.5, 2.0, pairs.shape[0])
    rows = np.column_stack([pairs, apart, (0.2 + 5.0 * apart) * misfit, misfit])
    found = _summed(rows)
    assert found.share == pytest.approx(0.2) and found.std == pytest.approx(0.0, abs=1e-9)
    assert _summed(rows[: FEWEST_PAIRS - 1]).share is None
    assert _summed(rows[rows[:, 0] < 3.0]).share is None


def test_the_place_of_a_misfit_is_named() -> None:
    """Errors put into the second manoeuvre, and into windows of hard rudder, are said to be there."""
    ahead = plain(sailed("none"), 3)
    windows = [shot.windows for shot in ahead.fit.shots]
    even = [np.ones((one.begins.size, 3)) for one in windows]
    found = places(windows, even)
    assert found is not None and found.channels == pytest.approx((1 / 3, 1 / 3, 1 / 3))
    assert all(abs(place.excess) < 1e-12 for place in found.places)
    for by in ("manoeuvre", "leg", "rudder", "yaw_rate", "drift"):
        assert sum(place.share for place in found.places if place.by == by) == pytest.approx(1.0)
    loud = [even[0], 9.0 * even[1], even[2]]
    where = places(windows, loud)
    assert where is not None
    most = where.most("manoeuvre")
    assert most is not None and most.name == windows[1].run.name and most.share > 0.7
    hard = [np.ones((one.begins.size, 3)) for one in windows]
    for one, errors in zip(windows, hard, strict=True):
        for w, (begin, end) in enumerate(zip(one.begins, one.ends, strict=True)):
            errors[w, 1] = 100.0 * float(np.sqrt(np.mean(one.run.rudder_rad[begin : end + 1] ** 2)) > 0.3)
    where = places(windows, hard)
    assert where is not None
    first, second = said(RemainingMisfit(NOTHING, where), "what is left")
    assert first == (
        "How much of what is left is noise of the experiment is not known: no two legs repeat each other in different "
        "manoeuvres."
    )
    assert second.startswith("What is left is largest in yaw rate (") and "with most rudder has " in second


NOTHING = Repeats(None, None, 0.0, 0, 0)


def test_evenly_spread_is_said_so_and_a_share_beyond_one_is_one() -> None:
    ahead = plain(sailed("none"), 3)
    windows = [shot.windows for shot in ahead.fit.shots]
    where = places(windows, [np.ones((one.begins.size, 3)) for one in windows])
    assert where is not None
    known = replace(NOTHING, share=1.04, std=0.08, pairs=40, manoeuvres=6)
    first, second = said(RemainingMisfit(known, where), "what is left")
    assert first.startswith("Of what is left, 100 ± 8 % (1 s.e.) is noise") and first.endswith(
        "by 40 pairs of legs in 6 manoeuvres that nearly repeat each other."
    )
    assert second.endswith("no manoeuvre, leg, rudder angle, yaw rate or drift stands out.")


def test_a_model_that_runs_away_has_no_place() -> None:
    ahead = plain(sailed("none"), 3)
    windows = [shot.windows for shot in ahead.fit.shots]
    errors = [np.ones((one.begins.size, 3)) for one in windows]
    errors[0][0] = np.inf
    assert places(windows, errors) is None
    found: Places | None = places(windows, [0.0 * one for one in errors[1:]] + [np.full_like(errors[0], np.nan)])
    assert found is None

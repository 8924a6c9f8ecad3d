"""Waves of a plant that shares no code with the effect: they meet the ship by heading and speed, or always alike."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest

from benchmarks.diagnose.hidden_effects import programme, sail
from kempf.pipeline.diagnose.screening.forward_selection import added
from kempf.pipeline.diagnose.screening.screen import score
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas import effects
from tests.diagnose.sailing import WORKERS, Sailed, sailed

WAVES = effects.get("waves")
#: of a wave as long as the ship, over the square root of gravity by length
LONG = np.sqrt(2.0 * np.pi)


def found(ship: Sailed) -> tuple[PooledFit, float]:
    """The fit with waves, and the log-likelihood that they gain."""
    base = staged(ship.runs, ship.spec, (), WORKERS)[1][-1]
    fit = added(base, score(base, WAVES, WORKERS), WORKERS)
    return fit, fit.log_likelihood - base.log_likelihood


@pytest.mark.parametrize("seed", [3, 5, 6])
def test_waves_are_found_with_their_size_length_and_direction(seed: int) -> None:
    ship = sailed("waves", strength=1, seed=seed)
    fit, gain = found(ship)
    c, k, chi = fit.values
    weather = programme.weather(programme.ship("mariner", seed), "moderate", seed, 0)
    apart = (chi - weather.wave_from_rad + np.pi) % (2.0 * np.pi) - np.pi
    assert gain > 500.0
    # the readings are means over the grid's step, so that a little of the swing is lost
    assert 0.75 * ship.c < c < 1.1 * ship.c and k == pytest.approx(LONG, rel=0.08)
    assert abs(apart) < max(3.0 * fit.std[8], 0.1)
    assert not any(at.any() for at in fit.model.at_bounds(fit.values))


def test_waves_that_meet_her_alike_on_every_heading_are_found_too() -> None:
    constants = sail.constants

    def alike(*given: object) -> object:
        hull = constants(*given)  # type: ignore[arg-type]
        # gravity, by which the plant makes the frequency go with the heading
        hull[-1] = 1e9
        return hull

    with patch.object(sail, "constants", alike):
        sailed.cache_clear()
        ship = sailed("waves", strength=0, seed=5)
        sailed.cache_clear()
    fit, gain = found(ship)
    assert gain > 300.0 and 0.75 * ship.c < fit.values[0] < 1.5 * ship.c

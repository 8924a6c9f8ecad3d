"""The noise of a boat's rudder is no play in her steering gear."""

from __future__ import annotations

import pytest

from kempf.pipeline.channels.series import Series
from kempf.pipeline.diagnose.screening.screen import score
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record import cut
from kempf.schemas.effects import get
from tests.diagnose.sailing import WORKERS, Sailed, sailed


def as_read(rudder: Series, _: float) -> Series:
    return rudder


def plain(ship: Sailed) -> PooledFit:
    _, (fit,) = staged(ship.runs, ship.spec, (), WORKERS)
    return fit


@pytest.mark.parametrize("seed", [3, 5])
def test_a_play_that_only_smooths_the_rudders_noise_is_not_seen(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    fit = plain(sailed.__wrapped__(name="usv", seed=seed))
    monkeypatch.setattr(cut, "without_noise", as_read)
    raw = plain(sailed.__wrapped__(name="usv", seed=seed))
    assert fit.log_likelihood > raw.log_likelihood + 10.0
    play, of_raw = (score(one, get("backlash"), WORKERS).score for one in (fit, raw))
    assert play < 5.0
    assert of_raw > 10.0

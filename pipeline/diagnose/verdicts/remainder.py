"""Whether something is left beside a model that the catalogue does not name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.diagnose.screening.forward_selection import is_ship
from kempf.pipeline.diagnose.screening.ridge_reference import RidgeReference
from kempf.pipeline.diagnose.steps.ladder_step import Step

#: log-likelihood that the flexible reference must still gain, in runs that did not fit it: something is left
LEFT_OVER = 8.0
#: and the share that this must be of what it gained beside the plain model: of an effect that was rightly named a
#: little stays unexplained, and the stronger the effect, the more log-likelihood that little is worth
LEFT_SHARE = 0.07
#: so many effects, of which the first has less than this share of the gain, together imitate something else
MANY, FIRST_SHARE = 3, 0.8
#: what explains the innovations must show to the flexible reference as far as the reference can see it: it lacks at
#: most this share of what it would gain, or what chance takes away
UNSEEN_SHARE = 0.5
#: standard errors of chance, and the reference's gain where there is only noise, one standard deviation
UNSEEN, REFERENCE_NOISE = 3.0, 2.0


def something_left(steps: Sequence[Step], before: RidgeReference | None, after: RidgeReference | None) -> bool:
    """Return whether something is there that the catalogue does not name.

    Either the flexible reference still finds what repeats itself; or the first effect that only the likelihood chose
    goes by v, r, rudder or heading and yet the reference, which tries all of these, does not see it in runs that did
    not fit it: what it imitates is something else; or it took several such effects of which the first explains little:
    terms that together imitate what none of them is.

    Parameters
    ----------
    before, after : RidgeReference or None
        Beside the first model and beside the last.
    """
    if reference_gains(before, after) or _unseen_by_reference(steps, before):
        return True
    ratios = [step.chosen_from[0][1].likelihood_ratio for step in steps[1:] if step.stability is None]
    return len(ratios) >= MANY and ratios[0] < FIRST_SHARE * sum(ratios)


def reference_gains(before: RidgeReference | None, after: RidgeReference | None) -> bool:
    """Return whether the flexible reference still finds what repeats itself, beyond a rest of what was found."""
    if before is None or after is None:
        return False
    return after.repeats and after.gain > max(LEFT_OVER, LEFT_SHARE * before.gain)


def _unseen_by_reference(steps: Sequence[Step], before: RidgeReference | None) -> bool:
    """Return whether the first effect found should have shown to the flexible reference, and did not."""
    # what predictions of legs chose is there, though disturbances carry it so well that one step ahead nothing shows
    if before is None or len(steps) < 2 or steps[1].stability is not None:
        return False
    # a hull that has bent to be no ship has made of the effect what neither it nor the reference is made of
    if not is_ship(steps[0].fit):
        return False
    foreseen = before.foreseen(steps[1].chosen_from[0][0].direction)
    # the log-likelihood that a signal is worth varies with noise by the root of twice what is to be expected of it
    chance = np.sqrt(2.0 * max(foreseen, 0.0) + REFERENCE_NOISE**2)
    return bool(foreseen - before.gain > max(UNSEEN * chance, UNSEEN_SHARE * foreseen))

"""What comes late is what was there before: the formulas of the latencies against the motion itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.effects import get
from kempf.schemas.model_spec import ModelSpec
from tests.diagnose.sailing import WORKERS, sailed
from tests.model.test_effects_in_filter import HULL, run

_SPEC = ModelSpec(wind="none", current="none")
#: measurements of no weight: the ship moves by her equations alone
_LEVELS = np.array([1e-12, 1e-12, 1e-12, 1e6, 1e6, 1e6])


def readings(effect: str | None = None, tau_s: float = 0.0) -> Float:
    """What would be read of a turn to both sides: lateral speed, yaw rate and heading, shape (n, 3)."""
    still = replace(run(), measured=np.zeros_like(run().measured))
    model = EffectModel((get(effect),) if effect else ())
    passed = RunFilter(still, model, _SPEC).run_filter(HULL, _LEVELS, np.full(len(model.names), tau_s))
    return -np.asarray(passed.innovation)


@pytest.mark.parametrize("late", [1, 3, 5])
@pytest.mark.parametrize("effect", ["heading_latency", "gyro_latency", "gnss_latency"])
def test_a_late_reading_is_that_of_some_time_ago(effect: str, late: int) -> None:
    now, seen = readings(), readings(effect, float(late) * run().step_s)
    speed, ago = run().inputs[::ROWS, 0], slice(None, -late)
    v, r, heading = now.T

    def across(over_ground_of: slice, heading_of: slice) -> Float:
        turned = heading[over_ground_of] - heading[heading_of]
        return np.asarray(v[over_ground_of] * np.cos(turned) + speed[over_ground_of] * np.sin(turned))

    # eq. (18) with the heading, or the velocity over ground, of some time ago
    expected = {
        "heading_latency": [(2, heading[ago], -r), (0, across(slice(late, None), ago), speed * r)],
        "gyro_latency": [(1, r[ago], -np.gradient(r, run().step_s))],
        "gnss_latency": [(0, across(ago, slice(late, None)), -np.gradient(v, run().step_s) - speed * r)],
    }[effect]
    for column, true, slope in expected:
        first = now[late:, column] + late * run().step_s * slope[late:]
        wrong, of_first_order = (np.std(one - true) for one in (seen[late:, column], first))
        assert wrong < 0.45 * of_first_order, (column, wrong, of_first_order)


@pytest.mark.parametrize(("effect", "name"), [("heading_latency", "tanker"), ("gyro_latency", "usv")])
def test_a_long_latency_leaves_the_hull_alone(effect: str, name: str) -> None:
    ship = sailed(effect, strength=2, name=name)
    fit = staged(ship.runs, ship.spec, (get(effect),), WORKERS)[1][-1]
    assert abs(fit.values[0] - ship.c) < 3.0 * fit.std[6]

"""Single readings that leap are left out."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Series
from kempf.pipeline.channels.spikes import without_spikes
from kempf.schemas.units import SECOND_NS


def test_spikes_go_and_are_counted_steps_stay() -> None:
    time = np.arange(0.0, 900.0)
    speed = 8.0 - 0.8 * np.sin(np.pi * time / 150.0) ** 2 + 0.05 * np.random.default_rng(0).standard_normal(time.size)
    read = Series((time * SECOND_NS).astype(np.int64), speed)
    value = read.value.copy()
    value[[50, 200, 201, 640]] += [4.0, -3.0, -3.0, 6.0]
    found, count = without_spikes(Series(read.time_utc_ns, value))
    assert count == 4 and len(found) == len(read) - 4
    assert without_spikes(read) == (read, 0) or without_spikes(read)[1] == 0
    step = Series(
        read.time_utc_ns, np.where(np.arange(len(read)) < 400, 8.0, 5.0) + 0.01 * np.sin(np.arange(len(read)))
    )
    assert without_spikes(step)[1] == 0

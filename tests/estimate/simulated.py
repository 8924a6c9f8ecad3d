"""Simulated trials as the estimators get them: every reading at its true instant, no file in between."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, Trial, simulate_trial, zigzag_settings
from kempf.schemas.channels import CHANNELS
from kempf.schemas.units import SECOND_NS

CHANNEL_OF = {channel.column: channel for channel in CHANNELS.values()}
#: A force and a stream that do not change.
STEADY = Environment(wind_force=Disturbance(5e-3), current_north=Disturbance(0.15), current_east=Disturbance(0.2598))


@lru_cache(maxsize=16)
def sailed(
    hull: str = "mariner",
    *,
    seed: int = 0,
    noise_scale: float = 1.0,
    environment: Environment = PAPER_ENVIRONMENT,
    heading_deg: float = 70.0,
    duration_s: float = 1200.0,
    speed_loss: float | None = None,
) -> Trial:
    settings = zigzag_settings(hull, seed=seed, noise_scale=noise_scale, environment=environment, duration_s=duration_s)
    ship = settings.hull if speed_loss is None else replace(settings.hull, speed_loss=speed_loss)
    return simulate_trial(replace(settings, hull=ship, heading_deg=heading_deg))


def instruments_of(trial: Trial) -> Instruments:
    series = {}
    for record in trial.instruments:
        for column, value in record.values.items():
            channel = CHANNEL_OF[column]
            held = np.unwrap(value) if channel.wrap == "circle" else value
            series[channel.name] = Series(record.measured_utc_ns, held)
    return Instruments(series, dict.fromkeys(series, "simulated"), ())


def without(instruments: Instruments, *channels: str) -> Instruments:
    return replace(instruments, series={n: s for n, s in instruments.series.items() if n not in channels})


def changed(instruments: Instruments, channel: str, series: Series) -> Instruments:
    return replace(instruments, series={**instruments.series, channel: series})


def bounds(trial: Trial, lead_s: float = 20.0) -> tuple[int, int]:
    """From a while before the first execute to the end of the zigzag, UTC ns."""
    zigzag, start = trial.truth.zigzags[0], trial.settings.start_utc_ns
    return start + round((zigzag.start_s - lead_s) * SECOND_NS), start + round(zigzag.end_s * SECOND_NS)


def record_of(trial: Trial, *left_out: str) -> Record:
    return make_record(without(instruments_of(trial), *left_out), *bounds(trial))


def truth_of(trial: Trial) -> np.ndarray:
    p = trial.truth.parameters
    return np.array([p.a11, p.a12, p.a21, p.a22, p.b1, p.b2])

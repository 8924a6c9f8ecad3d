"""Noise of instruments that lasts from one reading to the next: one file a measurement, in the form of an effect's.

A receiver smooths, a rate gyro drifts, a compass card swings: errors follow each other. They move no ship, so they are
no effects to be named, but a fit that takes them for motion bends the hull (decision 0042).
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from kempf.schemas.effect import Effect
from kempf.schemas.effect_file import read

__all__ = ["NAMES", "lasting", "lasting_noise"]

#: Names of the processes; no effect may bear one of them.
NAMES = ("heading_noise", "lateral_speed_noise", "yaw_rate_noise")
_FOLDER = files(__name__)


@cache
def lasting_noise() -> dict[str, Effect]:
    """Return every process by name, in alphabetical order."""
    return {name: _process(f"{name}.yaml") for name in NAMES}


def _process(file: str) -> Effect:
    return read(_FOLDER.joinpath(file).read_text(encoding="utf-8"), f"schemas/instrument_noise/{file}")


def lasting(effect: Effect) -> bool:
    """Return whether an effect of a model is lasting noise of an instrument and none of the ship's."""
    return effect.name in NAMES

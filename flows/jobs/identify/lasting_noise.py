"""Lasting noise of instruments in a parameter set: stored with its noise, and built again from there."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.instrument_noise import lasting_noise
from kempf.warehouse.tables.parameter_set import ParameterSet, StoredValue


def lasting_noise_of(fit: PooledFit) -> tuple[StoredValue, ...]:
    """Return the lasting noise of a fit, as ``process.parameter``."""
    return tuple(
        StoredValue(name, value, std if np.isfinite(std) and std > 0.0 else None, unit)
        for name, value, std, unit in fit.noise
    )


def with_lasting_noise(parameter_set: ParameterSet, model: EffectModel, values: Float) -> tuple[EffectModel, Float]:
    """Return a ship's model and its values, shape (p,), with the lasting noise of a set at their end.

    Noise levels of a set belong to this model.
    """
    levels = {p.name: p.value for p in parameter_set.noise}
    noise = tuple(process for name, process in lasting_noise().items() if f"{name}.c" in levels)
    whole = EffectModel((*model.effects, *noise))
    own = [levels[name] for name in whole.names[len(model.names) :]]
    return whole, np.concatenate([values, np.array(own, dtype=np.float64)])

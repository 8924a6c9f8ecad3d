"""Sizes of effects in words, in the units people use, with their standard errors."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.unsure_instants import row_around
from kempf.pipeline.diagnose.steps.confirm import Confirmation
from kempf.pipeline.diagnose.steps.final_sizes import Size, refitted_size
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.schemas.effect import Effect
from kempf.schemas.units import as_read


def stated(diagnosis: Diagnosis, step: Step, effect: Effect) -> str:
    """Return the size of an effect that is claimed, from that fit which predicts better.

    Where parameters fitted to legs predict better than the likelihood's, so do the sizes of effects; those of what
    could be in the place of an effect are then not given.
    """
    row_s = row_around_size(diagnosis, effect)
    size = _stated(diagnosis, step, effect)
    if row_s is None:
        return size
    return f"{size}; rows of {row_s:.2g} s that hold each instrument's last reading can do that by themselves"


def row_around_size(diagnosis: Diagnosis, effect: Effect) -> float | None:
    """Return the time between the rows of a table where a latency that is claimed is smaller, s; else None."""
    size = diagnosis.sizes.get(effect.name)
    return None if size is None else row_around(diagnosis.fitted, effect, float(size.values[0]))


def _stated(diagnosis: Diagnosis, step: Step, effect: Effect) -> str:
    ahead = diagnosis.steps[-1].ahead
    if ahead is None or ahead.disagrees is None:
        return sized(effect, diagnosis.sizes[effect.name])
    if step.added is None or effect.name != step.added.name:
        return effect.title
    own = ahead.model.own(effect.name)
    std = ahead.std[-ahead.fit.values.size :]
    return f"{_with_size(effect, ahead.fit.values[own], std[own])}, fitted to legs"


def sized(effect: Effect, size: Size) -> str:
    """Return an effect's size with its standard errors, in the units people use."""
    return _with_size(effect, size.values, size.std)


def sized_by_refit(effect: Effect, confirmation: Confirmation) -> str:
    """Return the size of an effect in the refit that it was chosen or refused by."""
    return sized(effect, refitted_size(effect, confirmation))


def _with_size(effect: Effect, values: Float, std: Float) -> str:
    within = [v % (2.0 * np.pi) if p.is_direction else v for p, v in zip(effect.parameters, values, strict=True)]
    shown = [_shown(p.name, v, s, p.unit) for p, v, s in zip(effect.parameters, within, std, strict=True)]
    return f"{effect.title}, {', '.join(shown)}"


def _shown(name: str, value: float, std: float, unit: str) -> str:
    factor, shown = as_read(unit)
    digits = max(0, 1 - int(np.floor(np.log10(abs(std * factor))))) if np.isfinite(std) and std > 0.0 else 4
    digits = min(digits, 8)
    error = f" ± {std * factor:.{digits}f}" if np.isfinite(std) else ""
    note = " (1 s.e.)" if error else ""
    return f"{name} = {value * factor:.{digits}f}{error}{f' {shown}' if shown else ''}{note}"

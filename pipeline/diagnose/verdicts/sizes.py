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
    chosen = _chosen(diagnosis, step, effect)
    if chosen is None:
        return effect.title
    values, std, how = chosen
    words, row_s = f"{_with_size(effect, values, std)}{how}", row_around_size(diagnosis, step, effect)
    if row_s is None:
        return words
    return (
        f"{words}; this is less than the {row_s:.2g} s between rows: a table whose rows hold the last reading of each "
        "instrument can show such a latency where there is none"
    )


def row_around_size(diagnosis: Diagnosis, step: Step, effect: Effect) -> float | None:
    """Return the time between the rows of a table, s, where a latency that is claimed is shorter; otherwise None."""
    chosen = _chosen(diagnosis, step, effect) if effect.name in diagnosis.sizes else None
    return None if chosen is None else row_around(diagnosis.fitted, effect, float(chosen[0][0]))


def _chosen(diagnosis: Diagnosis, step: Step, effect: Effect) -> tuple[Float, Float, str] | None:
    """Return values and standard errors of the fit that predicts better, and how it was made; None of no size."""
    ahead = diagnosis.steps[-1].ahead
    if ahead is None or ahead.disagrees is None:
        size = diagnosis.sizes[effect.name]
        return size.values, size.std, ""
    if step.added is None or effect.name != step.added.name:
        return None
    own = ahead.model.own(effect.name)
    std = ahead.std[-ahead.fit.values.size :]
    return ahead.fit.values[own], std[own], ", fitted to legs"


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

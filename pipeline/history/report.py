"""What was found of a history as JSON content with its units, for programs and for tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.history.changes import Change, Changes
from kempf.pipeline.history.pooled import Pooled
from kempf.pipeline.history.sets import ParameterHistory
from kempf.schemas.instants import iso_cut


def report(history: ParameterHistory, pooled: Pooled | None, changes: Changes) -> dict[str, Any]:
    """Return the answer of `pooled.pool` and `changes.find_changes` as JSON content; NaN stands for unknown.

    Parameters
    ----------
    history : ParameterHistory
        What they were asked of.
    pooled : Pooled or None
        None where there is no set.
    """
    settings = changes.settings
    return {
        "sets": len(history),
        "occasions": [iso_cut(int(t), "s") for t in changes.occasion_utc_ns],
        "pooled": None if pooled is None else _pooled(history, pooled, settings.level),
        "verdict": changes.verdict,
        "why": changes.why,
        "p_value": changes.p_value,
        "level": settings.level,
        "changes": [_change(history, change, settings.level) for change in changes.changes],
        "scatter_between_trials": _sizes(history, changes.scatter, changes.mean),
        "smallest_step_seen": {"power": settings.power, **_sizes(history, changes.smallest, changes.mean)},
    }


def _pooled(history: ParameterHistory, pooled: Pooled, level: float) -> dict[str, Any]:
    std = np.sqrt(np.diag(pooled.covariance))
    return {
        "poolable": pooled.poolable(level),
        "p_value": pooled.p_value,
        "q": pooled.q,
        "degrees_of_freedom": pooled.dof,
        "scale": pooled.scale,
        "parameters": {
            name: {"value": float(value), "std": float(error), "unit": unit}
            for name, value, error, unit in zip(history.names, pooled.value, std, history.units, strict=True)
        },
        "set_p_values": [float(p) for p in pooled.set_p_value],
    }


def _sizes(history: ParameterHistory, size: Float, mean: Float) -> dict[str, Any]:
    return {
        name: {"value": float(s), "percent": _percent(s, m), "unit": unit}
        for name, s, m, unit in zip(history.names, size, mean, history.units, strict=True)
    }


def _percent(part: float, whole: float) -> float:
    return float(100.0 * part / abs(whole)) if whole else float("nan")


def _change(history: ParameterHistory, change: Change, level: float) -> dict[str, Any]:
    a_year = "/year" if change.kind == "drift" else ""
    parameters = {}
    for j, (name, unit) in enumerate(zip(history.names, history.units, strict=True)):
        size, half = float(change.change[j]), float(change.width * change.std[j])
        parameters[name] = {
            "before": float(change.before[j]),
            "change": size,
            "std": float(change.std[j]),
            "low": size - half,
            "high": size + half,
            "percent": _percent(size, change.before[j]),
            "percent_std": _percent(float(change.std[j]), change.before[j]),
            "unit": unit + a_year,
            "moved": bool(change.moved[j]),
        }
    return {
        "kind": change.kind,
        "between": [iso_cut(t, "s") for t in change.between_utc_ns],
        "interval": [iso_cut(t, "s") for t in change.interval_utc_ns],
        "confidence": 1.0 - level,
        "p_value": change.p_value,
        "bic_ahead_of_other_form": change.rival,
        "parameters": parameters,
        "alone": [
            {
                "parameter": history.names[j],
                "change": float(size),
                "std": float(std),
                "percent": _percent(size, change.before[j]),
                "unit": history.units[j] + a_year,
            }
            for j, size, std in change.alone
        ],
    }

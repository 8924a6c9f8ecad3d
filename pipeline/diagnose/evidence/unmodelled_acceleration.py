"""Sway and yaw acceleration that act on the ship beside a model, over drift, turn, rudder and heading."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas.diagnosis_evidence import Quartiles, UnmodelledAcceleration, UnmodelledPart

_BINS, _FEWEST = 12, 5


def unmodelled_acceleration(runs: Sequence[GridRun], states: Sequence[Float]) -> UnmodelledAcceleration:
    """Return what acts beside a model at the instants of all manoeuvres.

    Parameters
    ----------
    states : sequence of ndarray, shape (n, 4)
        v, r, F and M of each, given all its measurements (`kempf.pipeline.predict.smoothed_states`); a manoeuvre
        with NaN is left out.
    """
    known = [(run, x) for run, x in zip(runs, states, strict=True) if np.all(np.isfinite(x))]
    # a steady wind is no misfit
    sway = _joined([x[:, 2] - np.mean(x[:, 2]) for _, x in known])
    moments = [x[:, 2] * run.ship.arm_per_m + x[:, 3] for run, x in known]
    yaw = _joined([moment - np.mean(moment) for moment in moments])
    against = {
        "lateral_speed": _joined([x[:, 0] for _, x in known]),
        "yaw_rate": _joined([x[:, 1] for _, x in known]),
        "rudder": _joined([run.rudder_rad for run, _ in known]),
        "heading": _joined([run.heading_rad % (2.0 * np.pi) for run, _ in known]),
    }
    return UnmodelledAcceleration(sway=_part(sway, against), yaw=_part(yaw, against), against=against)


def _joined(parts: Sequence[Float]) -> Float:
    return np.concatenate([*parts, np.zeros(0)])


def _part(values: Float, against: dict[str, Float]) -> UnmodelledPart:
    return UnmodelledPart(
        values=values,
        std=float(np.std(values)) if values.size else None,
        against={name: quartiles(x, values) for name, x in against.items()},
    )


def quartiles(x: Float, y: Float) -> Quartiles:
    """Return medians of y over bins of equal width in x, and the quartiles around them.

    Parameters
    ----------
    x, y : ndarray, shape (N,)

    Returns
    -------
    Quartiles
        Bins with fewer than five values are left out.
    """
    rows = []
    if x.size:
        edges = np.linspace(float(np.min(x)), float(np.max(x)), _BINS + 1)
        place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _BINS - 1)
        for k in range(_BINS):
            inside = y[place == k]
            if inside.size >= _FEWEST:
                rows.append((0.5 * (edges[k] + edges[k + 1]), *np.percentile(inside, [25.0, 50.0, 75.0])))
    middle, low, median, high = np.array(rows).reshape(-1, 4).T
    return Quartiles(middle=middle, low=low, median=median, high=high)

"""Where the search begins: plausible ships of several lengths."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.record import Instants
from kempf.pipeline.model.disturbances import level_of_change
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.model_spec import ModelSpec

#: lengths whose Mariner-like ship is tried, m: from a harbour drone to a supertanker, a factor 1.6 apart
_LENGTHS_M = tuple(float(f"{1.5 * 1.6**k:.4g}") for k in range(12))
#: changes of the rudder's side that the race of the starting points needs at most; a zigzag of 20 minutes has about ten
_TURNS = 30
#: time within which the changes of force and stream are guessed
_MINUTES_S = 300.0


def starting_points(record: Instants, spec: ModelSpec | None = None) -> list[tuple[str, Float]]:
    """Return named starting values of theta (see `kempf.pipeline.estimate.filters.linear_kernel`).

    Parameters
    ----------
    spec : ModelSpec, optional
        Its correlation rates tell what level a plausible change within minutes belongs to; without it the default ones.

    Returns
    -------
    list of (str, ndarray of shape (12,))
    """
    sigmas = noise_levels(record, spec or ModelSpec())
    # a ship that answers faster than this is like one that answers at once, and costs most to compute
    shortest = 3.0 * record.mean_speed_m_s * float(np.median(np.diff(record.time_s)))
    lengths = [length for length in _LENGTHS_M if length > shortest] or [_LENGTHS_M[-1]]
    points = [(f"Mariner scaled to {length:g} m", mariner_like(length).array()) for length in lengths]
    return [(name, np.concatenate([hull, np.log(sigmas)])) for name, hull in points]


def noise_levels(record: Instants, spec: ModelSpec) -> Float:
    """Return noise levels to start from: generous, so that a poor hull is not punished into a corner.

    Returns
    -------
    ndarray, shape (6,)
        Order of `kempf.schemas.model_spec.NOISE_PARAMETERS`.
    """
    spread = np.array([float(np.nanstd(column)) if np.isfinite(column).any() else 1.0 for column in record.measured.T])
    floor = np.nan_to_num(record.noise_start, nan=1e-3)
    measurement = np.maximum(floor, 0.15 * spread)
    force = 0.1 * float(np.nanstd(record.measured[:, 0])) / 10.0 + 1e-4
    # a yaw acceleration that would turn her through her spread of headings within a minute or so
    moment = 3e-4 * spread[2] + 1e-7
    forces = level_of_change(force, _MINUTES_S, spec.wind_correlation_rate_per_s)
    stream = level_of_change(0.05, _MINUTES_S, spec.current_correlation_rate_per_s)
    return np.concatenate([[forces, moment, stream], np.maximum(measurement, 1e-5)])


def thinned(record: Instants, instants: int) -> Instants:
    """Return the record with about this many of its instants, for the race of the starting points.

    Whole instants are dropped, so measurements stay where they were made; each kind of measurement keeps its share. Of
    a long record only the beginning takes part: thinned over all of it, nothing of the single turns would be left.
    """
    record = _beginning(record)
    measured = [np.flatnonzero(np.isfinite(column)) for column in record.measured.T]
    # counted by what was measured: many readings of the rudder in between must not thin the measurements out
    every = max(1, round(len(np.unique(np.concatenate(measured))) / instants))
    keep = np.zeros(record.time_s.size, dtype=np.bool_)
    keep[[0, -1]] = True
    for rows in measured:
        keep[rows[::every]] = True
    return _kept(record, keep)


def _beginning(record: Instants) -> Instants:
    """Cut a record after `_TURNS` changes of the rudder's side; whole if there are fewer."""
    over = np.abs(record.rudder_rad) > 0.5 * float(np.std(record.rudder_rad))
    side = np.sign(record.rudder_rad[over])
    turns = np.flatnonzero(over)[1:][side[1:] != side[:-1]]
    return _kept(record, slice(0, int(turns[_TURNS]))) if turns.size > _TURNS else record


def _kept(record: Instants, rows: Any) -> Instants:
    return replace(
        record,
        time_s=record.time_s[rows],
        speed_m_s=record.speed_m_s[rows],
        rudder_rad=record.rudder_rad[rows],
        rudder_noise_rad_sqrt_s=record.rudder_noise_rad_sqrt_s[rows],
        speed_error=record.speed_error.at(rows),
        measured=record.measured[rows],
        heading_rad=record.heading_rad[rows],
    )

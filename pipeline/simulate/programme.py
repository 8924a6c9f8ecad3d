"""A whole programme sailed: step after step on one fine grid, with the record of what happened."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import radians

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.disturbances import Environment
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.manoeuvre import (
    TICK_S,
    HandSteering,
    ManoeuvreRecord,
    SteadyCourse,
    Step,
    TurningCircle,
    ZigzagTest,
)
from kempf.pipeline.simulate.plant import STATE, hull_constants, slopes, steer
from kempf.pipeline.simulate.random_streams import stream
from kempf.pipeline.simulate.trajectory import Trajectory
from kempf.schemas.errors import UsageError

Float = NDArray[np.float64]

#: Distance of the points of the fine grid, s.
GRID_S = 0.02

_HEADING = STATE.index("psi")


@dataclass(frozen=True, eq=False)
class _Tables:
    """What the kernel fills, one row a point of the fine grid."""

    #: Shape (n, 6). See `kempf.pipeline.simulate.plant.STATE`.
    state: Float
    #: rudder, order: Shape (n,). Rudder angle and order, rad.
    rudder: Float
    order: Float
    #: Shape (n, 4). Given; see `kempf.pipeline.simulate.disturbances.FORCING`.
    forcing: Float


def sail(
    hull: SimulatedHull,
    programme: tuple[Step, ...],
    environment: Environment,
    *,
    seed: int,
    heading_deg: float = 0.0,
    substeps: int = 1,
) -> tuple[Trajectory, tuple[ManoeuvreRecord, ...]]:
    """Sail a programme from a straight course at the trial speed.

    Parameters
    ----------
    hull : SimulatedHull
        The ship.
    programme : tuple of Step
        What she does, in order; at least one step.
    environment : Environment
        What acts on her.
    seed : int
        Of the disturbances and of hand steering.
    heading_deg : float
        Heading at the start.
    substeps : int
        Integrator steps in a cell of the grid; the disturbances and orders stay the same.

    Returns
    -------
    trajectory : Trajectory
    records : tuple of ManoeuvreRecord
        One a step.

    Raises
    ------
    UsageError
        The programme is empty, a duration is not positive, or the ship ran out of the model's range.
    """
    _check(programme)
    cells = [round(step.duration_s / GRID_S) for step in programme]
    n = sum(cells) + 1
    tables = _Tables(np.zeros((n, 6)), np.zeros(n), np.zeros(n), environment.forcing(n, GRID_S, seed))
    tables.state[0, _HEADING] = radians(heading_deg)
    tables.state[0, STATE.index("V")] = hull.trial_speed_m_s
    constants = hull_constants(hull)
    records = []
    row = 0
    for index, (step, longest) in enumerate(zip(programme, cells, strict=True)):
        steering = step.steering(hull, float(tables.state[row, _HEADING]), stream(seed, f"manoeuvre {index}"))
        # one crossing a cell is more than any ship can do
        crossings = np.zeros(longest + 1 if isinstance(step, ZigzagTest) else 1)
        done, count = steer(
            steering.kind,
            steering.settings,
            steering.orders,
            (GRID_S, substeps, round(TICK_S / GRID_S)),
            (row, longest),
            (hull.rudder_rate_rad_s, hull.rudder_limit_rad),
            constants,
            tables.state,
            tables.rudder,
            tables.order,
            tables.forcing,
            crossings,
        )
        records.append(_record(step, tables, row, row + done, crossings[:count]))
        row += done
    end = row + 1
    _check_range(hull, tables.state[:end])
    state, rudder, forcing = tables.state[:end], tables.rudder[:end], tables.forcing[:end]
    slope = slopes(state, rudder, forcing, constants)
    return Trajectory(GRID_S, state, slope, rudder, tables.order[:end], forcing), tuple(records)


def _record(step: Step, tables: _Tables, first: int, last: int, crossings: Float) -> ManoeuvreRecord:
    start, end = first * GRID_S, last * GRID_S
    base = float(tables.state[first, _HEADING])
    if isinstance(step, TurningCircle):
        return ManoeuvreRecord(step, start, end, base, (start,))
    if not isinstance(step, ZigzagTest):
        return ManoeuvreRecord(step, start, end, base)
    instants = [float(t) for t in crossings]
    executes = [start, *instants]
    if step.legs is not None and len(instants) >= step.legs:
        executes, end = executes[: step.legs], instants[-1]
    beyond = _overshoots(step, tables, base, np.array([*instants, end]), last)
    return ManoeuvreRecord(step, start, end, base, tuple(executes), beyond)


def _overshoots(step: ZigzagTest, tables: _Tables, base: float, instants: Float, last: int) -> tuple[float, ...]:
    """Return the greatest heading beyond psi0 after each crossing; the last instant is the end of the record."""
    side = 1.0 if step.first_side == "starboard" else -1.0
    overshoots = []
    for begin, end in pairwise(instants):
        first, stop = int(np.ceil(begin / GRID_S)), min(int(end / GRID_S), last) + 1
        heading = side * (tables.state[first:stop, _HEADING] - base)
        if heading.size < 3 or int(np.argmax(heading)) == heading.size - 1:
            break  # still turning outward when the record ended
        top = int(np.argmax(heading))
        peak = float(heading[top])
        if top > 0:
            # the vertex of the parabola through the three highest points
            left, right = heading[top - 1], heading[top + 1]
            peak -= float((right - left) ** 2 / (8.0 * (right - 2.0 * peak + left)))
        overshoots.append(peak - radians(step.heading_deg))
        side = -side
    return tuple(overshoots)


def _check(programme: tuple[Step, ...]) -> None:
    if not programme:
        raise UsageError(
            "programme_empty",
            "The trial programme has no step, at least one is needed.",
            "Add a SteadyCourse or a ZigzagTest.",
        )
    for step in programme:
        if not step.duration_s >= GRID_S:
            raise UsageError(
                "programme_duration",
                f"{step.kind} lasts {step.duration_s} s, expected at least {GRID_S} s.",
                "Give a positive duration in seconds.",
            )
        if isinstance(step, ZigzagTest) and step.legs is not None and step.legs < 1:
            raise UsageError(
                "programme_legs",
                f"A zigzag has {step.legs} legs, expected at least 1.",
                "Give legs=None or 1 and more.",
            )
        if isinstance(step, HandSteering) and not 0 < step.shortest_period_s < step.longest_period_s:
            raise UsageError(
                "programme_band",
                f"Hand steering between periods of {step.shortest_period_s} and {step.longest_period_s} s is no band.",
                "Give 0 < shortest_period_s < longest_period_s.",
            )
        if isinstance(step, SteadyCourse) and step.heading_deg is not None and not np.isfinite(step.heading_deg):
            raise UsageError(
                "programme_heading", "The heading of a steady course is not finite.", "Give degrees, or None."
            )


def _check_range(hull: SimulatedHull, state: Float) -> None:
    speed = state[:, STATE.index("V")]
    turn = np.abs(state[:, STATE.index("r")]) * hull.length_m / hull.trial_speed_m_s
    if bool(np.all(np.isfinite(state))) and bool(np.all(speed > 0.0)) and bool(np.all(turn < 5.0)):
        return
    raise UsageError(
        "plant_out_of_range",
        f"The ship {hull.name} left the range of eq. (16): she stopped, or turned at more than five speeds per length.",
        "Take a smaller rudder angle, a shorter manoeuvre or a more stable hull.",
    )

"""Eq. (16) with effects as one model: the programs of their terms laid out for the filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model import dynamics
from kempf.pipeline.model.effects import RUDDER_COURSES
from kempf.pipeline.model.rudder_line import RudderLine
from kempf.pipeline.model.terms.expression import compiled
from kempf.pipeline.model.terms.program import CONSTANT, VARIABLE
from kempf.schemas.effect import Effect, Parameter
from kempf.schemas.errors import UsageError
from kempf.schemas.instrument_noise import lasting
from kempf.schemas.symbols import ACCELERATION_SYMBOLS, INDEX, INSTRUMENT_STATES, OWN_STATES

_PLACE = {
    "speed": dynamics.ON_SPEED,
    "rudder": dynamics.ON_RUDDER,
    "sway": dynamics.ON_SWAY,
    "yaw": dynamics.ON_YAW,
    "lateral_speed": dynamics.ON_LATERAL,
    "yaw_rate": dynamics.ON_YAW_RATE,
    "heading": dynamics.ON_HEADING,
}
#: part of a step of the grid that lasting noise lasts at least
_SHORTEST = 0.25

Table = tuple[NDArray[np.int64], NDArray[np.int64], Float, NDArray[np.int64]]


@dataclass(frozen=True, eq=False)
class EffectModel:
    """A model: eq. (16) and effects in order.

    Parameters
    ----------
    effects : tuple of Effect
        None twice.
    """

    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        names = [effect.name for effect in self.effects]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise UsageError("effect_twice", f"The model holds {twice[0]!r} twice.", "Name every effect once.")
        own = [effect for effect in self.effects if not lasting(effect)]
        brought = sum(len(effect.states) for effect in own)
        if brought > dynamics.MOST_EXTRA:
            raise UsageError(
                "too_many_states",
                f"The effects {', '.join(effect.name for effect in own)} bring {brought} states along; "
                f"{dynamics.MOST_EXTRA} is the most.",
                "Leave one of those with states of their own out.",
            )

    @property
    def extra(self) -> int:
        """How many states the effects bring along."""
        return sum(len(effect.states) for effect in self.effects)

    @property
    def parameters(self) -> tuple[tuple[Effect, Parameter], ...]:
        """Every parameter with its effect, in the order of the parameter vector."""
        return tuple((effect, parameter) for effect in self.effects for parameter in effect.parameters)

    def own(self, name: str) -> NDArray[np.bool_]:
        """Return which parameters of the vector are those of an effect, shape (p,); none where the model lacks it."""
        return np.array([effect.name == name for effect, _ in self.parameters], dtype=np.bool_)

    @property
    def names(self) -> tuple[str, ...]:
        """``effect.parameter`` of every parameter."""
        return tuple(f"{effect.name}.{parameter.name}" for effect, parameter in self.parameters)

    @property
    def low(self) -> Float:
        """Lower bounds of the parameters, shape (p,)."""
        return np.array([p.low for _, p in self.parameters])

    def low_on(self, step_s: float) -> Float:
        """Return lower bounds where time goes by steps, shape (p,).

        The equation of noise that lasts a small part of a step is stiff: by the series for the exponential it grows
        instead of dying out where a step is six times as long.

        Parameters
        ----------
        step_s : float
            Of the grid, s.
        """
        shortest = [
            _SHORTEST * step_s if lasting(effect) and p.unit == "s" else -np.inf for effect, p in self.parameters
        ]
        low: Float = np.maximum(self.low, np.array(shortest))
        return low

    @property
    def high(self) -> Float:
        """Upper bounds, shape (p,)."""
        return np.array([p.high for _, p in self.parameters])

    @cached_property
    def of_ship(self) -> NDArray[np.bool_]:
        """Which parameters are the ship's and not those of an instrument's lasting noise, shape (p,)."""
        return np.array([not lasting(effect) for effect, _ in self.parameters], dtype=np.bool_)

    @property
    def ship(self) -> EffectModel:
        """The model without lasting noise of instruments."""
        return EffectModel(tuple(effect for effect in self.effects if not lasting(effect)))

    def at_bounds(self, values: Float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which parameters have ended at their lower and which at their upper bound, but for rounding.

        Parameters
        ----------
        values : ndarray, shape (p,)
            Of the parameters, in their order.
        """
        reach = 1e-9 * np.maximum(np.abs(self.high), np.abs(self.low))
        return values <= self.low + reach, values >= self.high - reach

    def with_effect(self, effect: Effect) -> EffectModel:
        """Return the model with one more effect at its end."""
        return EffectModel((*self.effects, effect))

    @cached_property
    def table(self) -> Table:
        """Programs, their code, their constants and the states that they move with, for the compiled kernels.

        Returns
        -------
        programs : ndarray of int64, shape (q, 5)
            What it is added to, first and last instruction, first and last of the states.
        code : ndarray of int64, shape (n, 2)
        constants : ndarray, shape (m,)
        moving : ndarray of int64
            States.
        """
        programs, codes, constants = [], [], []
        start, held, slot, first = 0, 0, 0, dynamics.PARAMETER
        for effect in self.effects:
            variables = dict(INDEX)
            for name in (*OWN_STATES, *INSTRUMENT_STATES):
                del variables[name]
            for i, state in enumerate(effect.states):
                variables[state.name] = dynamics.N_BEFORE + slot + i
            variables |= {p.name: first + i for i, p in enumerate(effect.parameters)}
            texts = [(_PLACE[target], text) for target, text in effect.terms.items()]
            for i, state in enumerate(effect.states):
                texts.append((dynamics.ON_EXTRA + slot + i, state.derivative))
                texts.append((dynamics.ON_NOISE + slot + i, state.noise))
                texts.append((dynamics.ON_INITIAL + slot + i, state.initial_std))
            for target, text in texts:
                program = compiled(text, variables)
                code = program.code.copy()
                code[code[:, 0] == CONSTANT, 1] += held
                programs.append((target, start, start + len(code)))
                codes.append(code)
                constants.append(program.constants)
                start, held = start + len(code), held + len(program.constants)
            slot, first = slot + len(effect.states), first + len(effect.parameters)
        moving = _moving([target for target, *_ in programs], codes, dynamics.N_BEFORE + self.extra)
        ends = np.cumsum([0, *(len(states) for states in moving)]).tolist()
        rows = [(*entry, *places) for entry, places in zip(programs, pairwise(ends), strict=True)]
        return (
            np.array(rows, dtype=np.int64).reshape(-1, 5),
            np.concatenate([*codes, np.zeros((0, 2), dtype=np.int64)]),
            np.concatenate([*constants, np.zeros(0)]),
            np.array([state for states in moving for state in states], dtype=np.int64),
        )

    def split(self, values: Float) -> list[Float]:
        """Cut the parameter vector into those of the single effects."""
        counts = np.cumsum([len(effect.parameters) for effect in self.effects])
        return [np.asarray(part) for part in np.split(values, counts[:-1])] if self.effects else []

    def rudder(self, time_s: Float, rudder_rad: Float, values: Float) -> Float:
        """Return what the effects make of the rudder's course.

        Parameters
        ----------
        time_s, rudder_rad : ndarray, shape (n,)
            Increasing instants, the rudder linear in between.
        values : ndarray, shape (p,)
            Parameters.
        """
        for effect, own in zip(self.effects, self.split(values), strict=True):
            if effect.rudder_course is not None:
                rudder_rad = RUDDER_COURSES[effect.rudder_course](time_s, rudder_rad, own)
        return rudder_rad

    def rudders(self, line: RudderLine, values: Float) -> Float:
        """Return the rudder as the effects have it for several sets of their parameters, shape (n, k).

        Parameters
        ----------
        line : RudderLine
            Its reading.
        values : ndarray, shape (p, k)
            Parameters.
        """
        if all(effect.rudder_course is None for effect in self.effects):
            return np.repeat(line.as_read[:, None], values.shape[1], axis=1)
        own, of = np.unique(values, axis=1, return_inverse=True)
        courses = [line.laid(self.rudder(line.time_s, line.angle_rad, column)) for column in own.T]
        return np.ascontiguousarray(np.stack(courses, axis=-1)[:, of])


def _moving(targets: Sequence[int], codes: Sequence[NDArray[np.int64]], width: int) -> list[list[int]]:
    """Return the states that each program moves with: by itself, or as the speed and the rudder that it asks for do."""
    asked = [{int(index) for operation, index in code if operation == VARIABLE} for code in codes]
    own = [{i for i in variables if i < width} for variables in asked]
    of_speed, of_rudder = set[int](), set[int]()
    for target, states in zip(targets, own, strict=True):
        if target == dynamics.ON_SPEED:
            of_speed |= states
    for target, states, variables in zip(targets, own, asked, strict=True):
        if target == dynamics.ON_RUDDER:
            of_rudder |= states | (of_speed if dynamics.SPEED in variables else set())
    through = {dynamics.SPEED: of_speed, dynamics.DELTA: of_rudder}
    through |= {INDEX[name]: set(range(width)) for name in ACCELERATION_SYMBOLS}
    return [
        sorted(states.union(*(through[i] for i in variables & through.keys())))
        for states, variables in zip(own, asked, strict=True)
    ]

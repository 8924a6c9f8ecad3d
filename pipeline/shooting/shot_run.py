"""One manoeuvre under one model, shot window by window: what is predicted, and how it moves with every unknown."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.batch import LANES, MOST
from kempf.pipeline.model.dynamics import N_AFTER, N_BEFORE
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.shooting.effect_states import integrate_effect_states
from kempf.pipeline.shooting.kernel import shoot
from kempf.pipeline.shooting.windows import Windows
from kempf.schemas.model_spec import N_HULL, ModelSpec

#: what may be off nothing for a whole manoeuvre, parts of the ship's own scales: F, M, c_1, c_2, b
_OWN = 5
#: F in U^2/L, M in U^2/L^2, current in U, bias of the rate gyro in U/L
_OWN_STD = np.array([0.05, 0.1, 0.3, 0.3, 0.02])
#: v, r, psi
_STATES = 3
_STEP = 1e-3

#: what is predicted, and its derivatives
Moved = tuple[Float, Float]


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Where the unknowns of one manoeuvre stand."""

    #: Shape (6 + p,). Hull and effects, shared by all manoeuvres.
    shared: Float
    #: Shape (5,). Constant F, M, c_1, c_2, b.
    own: Float
    #: Shape (w, 3). v, r, psi at the beginning of every window.
    starts: Float


@dataclass(frozen=True, eq=False)
class ShotRun:
    """A manoeuvre in windows, and a model."""

    windows: Windows
    model: EffectModel
    spec: ModelSpec

    @cached_property
    def own_std(self) -> Float:
        """How far the constants of the manoeuvre may lie from nothing, shape (5,), 0 for one that there is not."""
        run, spec = self.windows.run, self.spec
        U, L = run.approach_m_s, run.ship.length_m
        unit = np.array([U**2 / L, U**2 / L**2, U, U, U / L])
        current = spec.current != "none"
        bias = spec.rate_bias and bool(np.isfinite(run.measured[:, 1:]).any(axis=0).all())
        there = [True, True, current, current and spec.current == "earth", bias]
        return np.where(there, _OWN_STD * unit, 0.0)

    @cached_property
    def used(self) -> NDArray[np.int64]:
        """Which of the constants of the manoeuvre there are."""
        return np.flatnonzero(self.own_std)

    def begin(self, shared: Float) -> Unknowns:
        """Return unknowns to begin with: states as measured, nothing acting on the ship."""
        return Unknowns(shared, np.zeros(_OWN), np.nan_to_num(self.windows.start))

    def predicted(self, shared: Float, own: Float, starts: Float) -> Float:
        """Let the ship run over every window.

        Parameters
        ----------
        shared : ndarray, shape (6 + p, k)
        own : ndarray, shape (5, k)
        starts : ndarray, shape (w, 3, k)

        Returns
        -------
        ndarray, shape (m, 3, k)
            What would be measured, window after window.
        """
        run, k = self.windows.run, shared.shape[1]
        rudder = self.model.rudders(run.rudder_line, shared[N_HULL:])
        groups = [np.minimum(np.arange(first, first + MOST), k - 1) for first in range(0, k, MOST)]
        parts = [self._shot(shared[:, at], own[:, at], starts[..., at], rudder[:, at]) for at in groups]
        return np.concatenate(parts, axis=-1)[..., :k]

    def _shot(self, shared: Float, own: Float, starts: Float, rudder: Float) -> Float:
        """Do as `predicted`, for as many as go through together."""
        run, extra = self.windows.run, self.model.extra
        x0 = np.zeros((starts.shape[0], N_BEFORE + extra + N_AFTER, MOST))
        x0[:, :3], x0[:, 3], x0[:, 4] = starts, own[0], own[1]
        x0[:, -3:] = own[None, 2:]
        constants = run.constants(self.spec.rudder_speed_exponent)
        if extra:
            x0[:, N_BEFORE : N_BEFORE + extra] = self._led(shared, own, rudder, constants)[self.windows.begins]
        predicted = np.empty((self.windows.rows.size, 3, MOST))
        shoot(
            *(np.ascontiguousarray(shared[:N_HULL]), np.ascontiguousarray(shared[N_HULL:])),
            *(run.step_s, run.inputs, np.ascontiguousarray(rudder), run.offset_s, run.current_row),
            *(constants, self.windows.begins, self.windows.ends, x0),
            *(self.model.table, predicted, LANES),
        )
        return predicted

    def _led(self, shared: Float, own: Float, rudder: Float, constants: Float) -> Float:
        """Return the states of the effects at all instants of the run, shape (n, k, lanes)."""
        run = self.windows.run
        states = np.empty((run.measured.shape[0], self.model.extra, MOST))
        integrate_effect_states(
            *(np.ascontiguousarray(shared[:N_HULL]), np.ascontiguousarray(shared[N_HULL:])),
            *(run.step_s, run.inputs, np.ascontiguousarray(rudder), run.current_row, constants),
            *(self.windows.course, np.ascontiguousarray(own), self.model.table, states, LANES),
        )
        return states

    def steps(self, at: Unknowns, scale: Float) -> Float:
        """Return the steps of the differences: shared, constants that there are, states; shape (6 + p + d + 3,)."""
        L = self.windows.run.ship.length_m
        hull = 1e-4 * np.maximum(np.abs(at.shared[:N_HULL]), 0.05 * np.abs(mariner_like(L).array()))
        effects = [
            (-1.0 if value + 1e-2 * abs(p.steps[0]) > p.high else 1.0) * 1e-2 * abs(p.steps[0])
            for (_, p), value in zip(self.model.parameters, at.shared[N_HULL:], strict=True)
        ]
        return np.concatenate([hull, effects, _STEP * self.own_std[self.used], _STEP * scale])

    def moved(self, at: Unknowns, scale: Float, without: Moved | None = None) -> Moved:
        """Return what is predicted, shape (m, 3), and its derivatives, shape (m, 3, 6 + p + d + 3).

        Parameters
        ----------
        scale : ndarray, shape (3,)
            Of an error of v, r and psi.
        without : (ndarray, ndarray), optional
            The same of the model without its last effects, which are none of them there: only how the prediction moves
            with these is asked for then.
        """
        by = self.steps(at, scale)
        shared, own, starts = self._stepped(at, by)
        first = 0 if without is None else without[1].shape[2] - self.used.size - _STATES
        fresh = np.arange(first, by.size if without is None else at.shared.size)
        lanes = np.concatenate([[0], 1 + fresh])
        predicted = self.predicted(shared[:, lanes], own[:, lanes], starts[..., lanes])
        with np.errstate(invalid="ignore", over="ignore"):
            slopes: Float = (predicted[..., 1:] - predicted[..., :1]) / by[fresh]
        if without is None:
            return predicted[..., 0], slopes
        return without[0], np.insert(without[1], np.full(fresh.size, first), slopes, axis=2)

    def _stepped(self, at: Unknowns, by: Float) -> tuple[Float, Float, Float]:
        many = by.size + 1
        shared, own = np.tile(at.shared[:, None], many), np.tile(at.own[:, None], many)
        starts = np.tile(at.starts[..., None], many)
        first, d = at.shared.size, self.used.size
        for j in range(first):
            shared[j, 1 + j] += by[j]
        for j, k in enumerate(self.used):
            own[k, 1 + first + j] += by[first + j]
        for j in range(_STATES):
            starts[:, j, 1 + first + d + j] += by[first + d + j]
        return shared, own, starts

"""What a term gives at ordinary states of a ship: whether it is finite there, and 0 without parameters.

The ship is 100 m long and goes at 7.5 m/s; what is finite for her is finite for any.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.batch import ONE
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.model.terms.evaluation import evaluate
from kempf.pipeline.model.terms.expression import compiled
from kempf.pipeline.model.terms.places import Place, places, require_in_place, symbols_beside
from kempf.pipeline.model.terms.program import DEPTH, Program
from kempf.schemas.effect import Effect
from kempf.schemas.errors import UsageError
from kempf.schemas.symbols import INDEX, STATE_SYMBOLS, SYMBOLS

_SHIP = {
    **dict(zip(("a11", "a12", "a21", "a22", "b1", "b2"), mariner_like(100.0).array().tolist(), strict=True)),
    **{"L": 100.0, "T": 6.0, "V0": 7.5, "n0": 2.0},
}
_COLUMNS = ("v", "r", "psi", "delta", "V", "U", "gamma", "n", "h", "phi", "K", "t", "day")
#: on the approach, in turns to both sides, in the middle of a swing, slow, in wind, in shallow water, on another day;
#: every symbol is zero somewhere, but for those that never are
_STATES = (
    (0.0, 0.0, 0.0, 0.0, 7.5, 0.0, 0.0, 2.0, 50.0, 0.0, 0.0, 0.0, 0.0),
    (-0.8, 0.02, 1.2, 0.35, 5.5, 8.0, 0.5, 2.0, 50.0, -0.05, 1.0, 60.0, 0.0),
    (0.8, -0.02, -1.2, -0.35, 5.5, 8.0, -0.5, 2.0, 50.0, 0.05, 5.0, 60.0, 1.0),
    (-0.3, 0.008, 0.1, 0.0, 7.2, 12.0, 1.6, 1.9, 20.0, -0.01, 2.0, 20.0, 0.0),
    (0.3, -0.008, -0.1, 0.17, 7.2, 12.0, -1.6, 1.9, 20.0, 0.02, 3.1, 30.0, 0.0),
    (0.4, 0.0, 0.2, -0.17, 7.0, 5.0, 3.1, 2.1, 9.0, 0.03, 4.0, 100.0, 1.0),
    (0.0, 0.012, 0.3, -0.35, 6.8, 5.0, -3.1, 2.1, 9.0, 0.0, 0.3, 120.0, 2.0),
    (-0.5, -0.005, 0.4, 0.61, 6.5, 20.0, 0.8, 1.8, 15.0, 0.1, 1.5, 300.0, 0.0),
    (0.2, 0.02, -0.3, 0.1, 4.0, 3.0, 2.2, 1.2, 200.0, -0.1, 5.8, 400.0, 3.0),
    (-0.2, -0.02, -0.2, -0.1, 4.0, 3.0, -2.2, 1.2, 200.0, -0.02, 6.2, 500.0, 1.0),
    (0.05, 0.001, 0.0, 0.02, 1.0, 1.0, 0.1, 0.5, 30.0, 0.01, 2.5, 600.0, 0.0),
    (-0.02, -0.002, 0.02, -0.02, 0.5, 0.5, -0.1, 0.0, 30.0, -0.01, 0.9, 900.0, 0.0),
)
_SHOWN = ("v", "r", "delta", "V", "psi")


@dataclass(frozen=True, eq=False)
class Answer:
    """What an expression gives."""

    #: Shape (n_state,).
    value: Float
    #: Shape (n_state, 9). Derivatives with respect to `STATE_SYMBOLS`.
    slope: Float


def answer(text: str, parameters: Mapping[str, float], own_states: tuple[str, ...] = (), level: float = 0.0) -> Answer:
    """Evaluate an expression at the ordinary states.

    Parameters
    ----------
    level : float, optional
        Value of those states.

    Raises
    ------
    UsageError
        ``expression_invalid``.
    """
    index = {name: INDEX[name] for name in symbols_beside(own_states)}
    program = compiled(text, index | {name: len(SYMBOLS) + i for i, name in enumerate(parameters)})
    values = np.zeros(len(SYMBOLS) + len(parameters))
    values[len(SYMBOLS) :] = list(parameters.values())
    for name, number in {**_SHIP, **dict.fromkeys(own_states, level)}.items():
        values[INDEX[name]] = number
    rows = [run(program, _filled(values, state)) for state in _STATES]
    return Answer(np.array([row[0] for row in rows]), np.array([row[1:] for row in rows]))


def run(program: Program, values: Float) -> Float:
    """Return the value of a program and its derivatives with respect to the states, shape (10,).

    Parameters
    ----------
    values : ndarray, shape (n,)
        Of every variable, in the order of `kempf.schemas.symbols.SYMBOLS`, then parameters.
    """
    width = len(STATE_SYMBOLS)
    slopes = np.zeros((values.size, width, 1))
    slopes[:width, :, 0] = np.eye(width)
    stack = np.zeros((DEPTH, width + 1, 1))
    every = np.arange(width)
    evaluate(program.code, program.constants, every, values[:, None], slopes, stack, np.zeros(1), ONE)
    result: Float = stack[0, :, 0]
    return result


def _filled(values: Float, state: tuple[float, ...]) -> Float:
    filled = values.copy()
    for name, number in zip(_COLUMNS, state, strict=True):
        filled[INDEX[name]] = number
    filled[INDEX["F"]], filled[INDEX["M"]] = 0.01 * state[0], 0.01 * state[1]
    filled[INDEX["vdot"]], filled[INDEX["rdot"]] = -0.05 * state[0], -0.05 * state[1]
    filled[INDEX["vddot"]], filled[INDEX["rddot"]] = 0.003 * state[0], 0.003 * state[1]
    return filled


def require_ordinary(effect: Effect) -> None:
    """Refuse an effect whose terms cannot be computed at ordinary states, or do not vanish without parameters.

    Raises
    ------
    UsageError
        ``expression_invalid``; ``symbol_out_of_place``; ``effect_not_finite``: with the state at which it is not;
        ``effect_not_absent``.
    """
    own = tuple(state.name for state in effect.states)
    absent = {p.name: p.absent for p in effect.parameters}
    most = max((len(p.steps) for p in effect.parameters), default=0)
    trials = [absent, *({**absent, **_typical(effect, k)} for k in range(most))]
    for place in places(effect):
        require_in_place(place, own)
        for parameters in trials:
            _require_finite(effect, place, answer(place.text, parameters, own), parameters)
    quiet = all(
        not np.any(answer(place.text, absent, own).value) for place in places(effect) if place.name.startswith("m")
    )
    for target, text in effect.terms.items():
        rest = answer(text, absent, own, 0.0 if quiet else 0.1).value
        if np.any(rest != 0.0):
            raise UsageError(
                "effect_not_absent",
                f"With its parameters at 0 the term of {effect.name!r} for {target} is still "
                f"{rest[np.flatnonzero(rest)[0]]:.3g}; it must be 0 then, as without the effect.",
                "Write it so that a parameter multiplies the whole, as in 'c*(...)'.",
                {"effect": effect.name, "target": target},
            )


def driven_by_noise(effect: Effect) -> bool:
    """Return whether nothing but noise moves the states of an effect, and nothing else does what it does.

    Such an effect changes no prediction of a motion, however strong it is.
    """
    own = tuple(state.name for state in effect.states)
    texts = [*effect.terms.values(), *(state.derivative for state in effect.states)]
    return bool(own) and not any(np.any(answer(text, _typical(effect, 0), own).value) for text in texts)


def _typical(effect: Effect, k: int) -> dict[str, float]:
    return {p.name: p.steps[min(k, len(p.steps) - 1)] for p in effect.parameters}


def _require_finite(effect: Effect, place: Place, response: Answer, parameters: Mapping[str, float]) -> None:
    good_value = np.isfinite(response.value)
    good = good_value & np.isfinite(response.slope).all(axis=1)
    if good.all():
        return
    k = int(np.flatnonzero(~good)[0])
    quantity = "value" if not good_value[k] else "slope"
    state = dict(zip(_COLUMNS, _STATES[k], strict=True))
    at = ", ".join(
        [f"{name} = {state[name]:g}" for name in _SHOWN] + [f"{n} = {x:g}" for n, x in parameters.items() if x != 0.0]
    )
    raise UsageError(
        "effect_not_finite",
        f"The expression {place.text[:80]!r} for {place.name} has no finite {quantity} at {at}: an ordinary state.",
        "Keep what it divides by, or takes the root or logarithm of, away from 0: max(V, 0.1), sqrt(v**2 + 0.01).",
        {"effect": effect.name, "place": place.name, "state": state},
    )

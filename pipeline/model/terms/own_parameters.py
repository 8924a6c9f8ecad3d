"""Bounds and steps for the unknown numbers of a person's own formula, from what it gives at ordinary states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.terms.ordinary import answer
from kempf.schemas.effect import Parameter
from kempf.schemas.errors import UsageError

#: what counts as much on each target, in its unit: a number is tried where it does a tenth of that
_MUCH = {
    **{"sway": 0.05, "yaw": 1e-3, "rudder": 0.1, "speed": 0.5},
    **{"lateral_speed": 0.3, "yaw_rate": 3e-3, "heading": 0.03},
}
#: bounds, in steps
_REACH = 1000.0
#: where a number that shapes is looked for
_TRIED = 10.0 ** np.arange(-4.0, 4.5, 0.5)
#: what is less, or its inverse more, than any number of a ship
_SMALLEST = 1e-100
_MEANING = "a number of your own formula, in SI units"


def parameters_of(terms: Mapping[str, str], names: Sequence[str]) -> tuple[Parameter, ...]:
    """Return the unknown numbers of a formula: those that make the effect, then those that shape it.

    Parameters
    ----------
    terms : mapping of str to str
        Formula by target.

    Raises
    ------
    UsageError
        ``effect_no_effect``: a number changes nothing, or nothing that another does not.
    """
    shapes: list[str] = []
    for name in names:
        if not _moves(terms, name, dict.fromkeys(names, 1.0)):
            raise _idle(name, "changes nothing at any ordinary state", terms)
    while idle := [n for n in names if n not in shapes and not _moves(terms, n, _with(names, shapes))]:
        shapes.append(idle[-1])
    best = {name: _telling(terms, name, names) for name in shapes}
    makers = [n for n in names if n not in shapes]
    parameters = [_maker(terms, name, {**dict.fromkeys(names, 0.0), **best}) for name in makers]
    for name in (n for n in names if n in shapes):
        steps = tuple(_rounded(best[name] * factor) for factor in (0.3, 1.0, 3.0))
        low, high = steps[1] / _REACH, steps[1] * _REACH
        parameters.append(Parameter(name=name, low=low, high=high, steps=steps, meaning=f"{_MEANING}, positive"))
    return tuple(parameters)


def _with(names: Sequence[str], shapes: Sequence[str]) -> dict[str, float]:
    return {name: 1.0 if name in shapes else 0.0 for name in names}


def _given(terms: Mapping[str, str], values: Mapping[str, float]) -> Float:
    """Return what the terms give, in what counts as much, shape (n,)."""
    with np.errstate(all="ignore"):
        return np.concatenate([answer(text, values).value / _MUCH[target] for target, text in terms.items()])


def _moves(terms: Mapping[str, str], name: str, values: Mapping[str, float]) -> bool:
    there, gone = _given(terms, {**values, name: 1.0}), _given(terms, {**values, name: 0.0})
    return not np.array_equal(there, gone)


def _maker(terms: Mapping[str, str], name: str, values: Mapping[str, float]) -> Parameter:
    change = _given(terms, {**values, name: 1.0}) - _given(terms, {**values, name: 0.0})
    size = float(np.sqrt(np.mean(change**2))) if np.all(np.isfinite(change)) else 0.0
    step = _rounded(0.1 / size) if _SMALLEST < size < 1.0 / _SMALLEST else 1.0
    return Parameter(name=name, low=-_REACH * step, high=_REACH * step, steps=(step,), meaning=_MEANING)


def _telling(terms: Mapping[str, str], name: str, names: Sequence[str]) -> float:
    """Return where a number that shapes does so most: where a tenth more of it is least like a larger effect."""
    ones = dict.fromkeys(names, 1.0)
    shares = []
    for value in _TRIED.tolist():
        here, there = _given(terms, {**ones, name: value}), _given(terms, {**ones, name: 1.1 * value})
        norm = float(here @ here)
        if not (np.all(np.isfinite(there)) and 0.0 < norm < np.inf):
            shares.append(0.0)
            continue
        rest = there - here * float(here @ there) / norm
        shares.append(float(np.sqrt(rest @ rest / norm)))
    if max(shares) < 1e-9:
        raise _idle(name, "does nothing but what another number of the formula does", terms)
    return float(_TRIED[int(np.argmax(shares))])


def _rounded(value: float) -> float:
    return float(f"{value:.1g}")


def _idle(name: str, why: str, terms: Mapping[str, str]) -> UsageError:
    return UsageError(
        "effect_no_effect",
        f"The number {name!r} {why}: {'; '.join(terms.values())[:80]}.",
        "Write a formula that is not 0 where the ship turns, and leave out numbers that it does not need.",
        {"parameter": name},
    )

"""Rungs of a ladder as people compare them: errors in percent of the motion, sizes of what was added.

Where the last model has effects and predictions with it take the parameters fitted to legs, the free runs and sizes of
every rung are with these, so that rungs compare; elsewhere with the likelihood's.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import Any

from kempf.pipeline.predict.median_error import LEFT_THE_COURSE, median_error
from kempf.workbench.numbers import in_degrees, number

#: what is said beside free runs and sizes of `Rung.by_legs`
BY_LEGS = "free runs (median) and sizes: with the parameters fitted to legs, which predictions of manoeuvres take"


@dataclass(frozen=True)
class RungErrors:
    """Errors over manoeuvres, percent of the motion; None where there are none, NaN where one diverges."""

    fitted: float | None
    left_out: float | None
    held_out: float | None


@dataclass(frozen=True)
class EffectSize:
    """A parameter of an effect."""

    name: str
    value: float
    #: None where it is not known.
    std: float | None
    unit: str

    @property
    def words(self) -> str:
        """As people read it, see `sized`."""
        return sized(self.name, self.value, self.std, self.unit)


@dataclass(frozen=True)
class Rung:
    """One model of a ladder beside the others."""

    #: Whether free runs and sizes are with the parameters fitted to legs.
    by_legs: bool
    #: Means.
    leg: RungErrors
    #: Means; with the parameters fitted to legs medians, as those of a ship that keeps no course may run off. Left out
    #: is None.
    free: RungErrors
    #: Of the effect that was added.
    sizes: tuple[EffectSize, ...]
    #: How many free runs leave the measured course altogether, and of how many, where they are by legs.
    off: tuple[int, int] = (0, 0)


def compared(rungs: Sequence[Mapping[str, Any]]) -> list[Rung]:
    """Return rungs as they compare.

    Parameters
    ----------
    rungs : sequence of mapping
        JSON content of a ladder, in order.
    """
    # what computes is not loaded by a command that prints its help
    from kempf.flows.jobs.identify.leg_fit import taken_by_predictions

    last: Mapping[str, Any] = rungs[-1] if rungs else {}
    by_legs = bool(last.get("effects")) and taken_by_predictions(last.get("one_leg_ahead"))
    return [
        Rung(
            by_legs,
            _leg(rung),
            _free(rung, by_legs=by_legs),
            _sizes(rung, by_legs=by_legs),
            _off(rung) if by_legs else (0, 0),
        )
        for rung in rungs
    ]


def remarks(rungs: Sequence[Rung]) -> list[str]:
    """Return what is to be known of free runs and sizes of rungs, sentences without a full stop."""
    if not rungs or not rungs[-1].by_legs:
        return []
    off, many = rungs[-1].off
    lost = f"{off} of {many} free runs with the last model leave the measured course altogether"
    return [BY_LEGS, *([lost] if off else [])]


def effect_names(rung: Mapping[str, Any]) -> list[str]:
    """Return the names of the effects of a rung's model, in order."""
    return list(dict.fromkeys(name.partition(".")[0] for name in rung.get("effects") or ()))


def first_model(rung: Mapping[str, Any]) -> str:
    """Return what the first model of a ladder is called: the plain one, or one that has effects already."""
    effects = effect_names(rung)
    return "model with " + ", ".join(effects) if effects else "plain model"


def by_manoeuvre(rung: Mapping[str, Any]) -> dict[str, float]:
    """Return the free-run error of each manoeuvre with the parameters fitted to legs, percent of the motion.

    Of manoeuvres that came later there is none.
    """
    return {name: _in_percent(error) for name, error in (rung.get("free_run_fitted_to_legs") or {}).items()}


def sized(name: str, value: float, std: float | None, unit: str) -> str:
    """Return a parameter with its standard error, angles in degrees.

    Examples
    --------
    >>> sized("c", 0.1, 0.01, "rad"), sized("c", 2.2, None, "1")
    ('c 5.73 ± 0.57 deg', 'c 2.2 ± -')
    """
    shown, error, read_in = in_degrees(value, nan if std is None else std, unit)
    return f"{name} {number(shown)} ± {number(error, 2)} {'' if read_in in ('', '1') else read_in}".rstrip()


def in_words(error: float | None) -> str:
    """Return an error as people read it."""
    return "-" if error is None else "diverges" if isnan(error) else number(error, 3)


def _off(rung: Mapping[str, Any]) -> tuple[int, int]:
    errors = list(by_manoeuvre(rung).values())
    return sum(not error < 100.0 * LEFT_THE_COURSE for error in errors), len(errors)


def _leg(rung: Mapping[str, Any]) -> RungErrors:
    ahead = rung.get("one_leg_ahead") or {}
    return RungErrors(*(_mean((ahead.get(f"{s}_percent") or {}).values()) for s in ("fitted", "left_out", "held_out")))


def _free(rung: Mapping[str, Any], *, by_legs: bool) -> RungErrors:
    if by_legs and rung.get("free_run_fitted_to_legs"):
        legs = by_manoeuvre(rung)
        own = ([legs[name] for name in rung[key] if name in legs] for key in ("in_sample", "held_out"))
        fitted, held = (median_error(errors) if errors else None for errors in own)
    else:
        fitted, held = (
            _in_percent(rung[error]) if rung[key] else None
            for error, key in (("in_sample_error", "in_sample"), ("held_out_error", "held_out"))
        )
    return RungErrors(fitted, None, held)


def _mean(errors: Iterable[float | None]) -> float | None:
    every = [nan if error is None else error for error in errors]
    return sum(every) / len(every) if every else None


def _in_percent(error: float | None) -> float:
    return nan if error is None else 100.0 * error


def _sizes(rung: Mapping[str, Any], *, by_legs: bool) -> tuple[EffectSize, ...]:
    from kempf.pipeline.shooting.inflation import inflation

    ahead = rung.get("one_leg_ahead") or {}
    own = {n: one for n, one in rung["effects"].items() if n.partition(".")[0] == rung["added"]}
    factor = 1.0
    if by_legs and ahead:
        own = {name: {**ahead["parameters"][name], "unit": one.get("unit")} for name, one in own.items()}
        factor = inflation(ahead.get("fitted_misfit"), ahead.get("left_out_misfit"))
    return tuple(
        EffectSize(
            name.partition(".")[2],
            one["value"],
            None if one["std"] is None else factor * one["std"],
            one.get("unit") or "",
        )
        for name, one in own.items()
    )

"""Did the ship change? A step, several, a drift, or nothing that these data show, each with how sure that is.

Binary segmentation (Vostrikova 1981, Soviet Mathematics Doklady 24): where a stretch shows a step it is split there and
both sides are put to the same test, at half the level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from kempf.pipeline.channels.series import Float, Mask, Nanoseconds
from kempf.pipeline.history import effects
from kempf.pipeline.history.power import smallest_steps
from kempf.pipeline.history.scan import Stretch, judge, stretch
from kempf.pipeline.history.sets import ParameterHistory, occasions
from kempf.pipeline.history.settings import ChangeSettings
from kempf.schemas.enumeration import counted

Kind = Literal["step", "drift"]


@dataclass(frozen=True, eq=False)
class Change:
    """One change of the ship."""

    #: One of {"step", "drift"}.
    kind: Kind
    #: Last occasion before and first after a step; first and last of a drift.
    between_utc_ns: tuple[int, int]
    #: Occasions between which a step happened, with the confidence of the level; of a drift as above.
    interval_utc_ns: tuple[int, int]
    #: Of the stretch it was found in.
    p_value: float
    #: Shape (n_parameter,). Level before a step, or at the beginning of a drift.
    before: Float
    #: change, std: Shape (n_parameter,). In the parameters' units, of a drift per year.
    change: Float
    std: Float
    #: Simultaneous intervals of all parameters are ``change`` +- ``width`` ``std``.
    width: float
    #: BIC of the other form, step or drift, less that of this one; under 2 the data hardly show which it was.
    rival: float
    #: Parameters that could have changed alone: index, change and standard error if they did.
    alone: tuple[tuple[int, float, float], ...]

    @property
    def moved(self) -> Mask:
        """Which parameters' simultaneous intervals leave out 0."""
        moved: Mask = np.abs(self.change) > self.width * self.std
        return moved


@dataclass(frozen=True, eq=False)
class Changes:
    """What a history shows."""

    #: ``no change seen``, ``step``, ``steps``, ``drift``, ``step and drift``, ``steps and drift``, ``not testable with
    #: these data``.
    verdict: str
    #: In words.
    why: str
    #: In the order of time.
    changes: tuple[Change, ...]
    #: Of the whole history; NaN where not testable.
    p_value: float
    #: Shape (n_occasion,).
    occasion_utc_ns: Nanoseconds
    #: Shape (n_parameter,). Standard deviation between trials beyond their standard errors, in the parameters' units;
    #: NaN where unknown.
    scatter: Float
    #: Shape (n_parameter,).
    mean: Float
    #: Shape (n_parameter,). Step of one parameter alone, midway, that would be seen with the power of the settings; NaN
    #: where unknown.
    smallest: Float
    settings: ChangeSettings


def find_changes(history: ParameterHistory, settings: ChangeSettings | None = None) -> Changes:
    """Say whether a ship changed, when, by how much and in which parameters."""
    settings = settings or ChangeSettings()
    p = len(history.names)
    unknown = np.full(p, np.nan)
    merged = occasions(history, settings.occasion_s)
    mean = np.mean(merged.value, axis=0) if len(merged) else unknown
    why = _not_testable(history, merged, settings)
    if why:
        return Changes(
            "not testable with these data", why, (), np.nan, merged.time_utc_ns, unknown, mean, unknown, settings
        )
    whole = stretch(merged, settings)
    p_value = judge(whole, settings.level).p_value
    places = _search(merged, settings, settings.level, 0)
    changes = tuple(_fitted(merged, settings, places, i) for i in range(len(places)))
    steps, drifts = (sum(c.kind == kind for c in changes) for kind in ("step", "drift"))
    verdict = (
        "no change seen"
        if not changes
        else " and ".join([*([] if not steps else ["step" if steps == 1 else "steps"]), *(["drift"] if drifts else [])])
    )
    quiet = _without(merged, changes)
    rest = stretch(quiet, settings)
    tau = np.sqrt(rest.statistics(rest.value).scatter[p:]) * rest.scale
    smallest = smallest_steps(rest, judge(rest, settings.level)) * np.abs(rest.scale)
    share = f"{100 * p_value:{'.2g' if p_value < 0.99 else '.0f'}} %"
    sentence = f"in {share} of histories without change something at least as remarkable is seen"
    return Changes(verdict, sentence, changes, p_value, merged.time_utc_ns, tau, mean, smallest, settings)


def _not_testable(history: ParameterHistory, merged: ParameterHistory, settings: ChangeSettings) -> str:
    if len(merged) < settings.fewest:
        sets, days = (counted(n, noun) for n, noun in ((len(history), "parameter set"), (len(merged), "occasion")))
        shared = f"; sets begun within {settings.occasion_s / 3600:g} h are one occasion: they share load and weather"
        return (
            f"{sets} with covariances on {days}, at least {settings.fewest} occasions are needed, "
            f"{settings.smallest_side} on either side of a step{shared if len(merged) < len(history) else ''}"
        )
    if merged.time_utc_ns[0] == merged.time_utc_ns[-1]:
        return "all parameter sets are of one instant"
    return ""


@dataclass(frozen=True)
class _Place:
    """Where the search found a change: sets first to last - 1, a step before set ``split``."""

    kind: Kind
    first: int
    split: int
    last: int
    p_value: float
    rival: float


def _search(history: ParameterHistory, settings: ChangeSettings, level: float, first: int) -> list[_Place]:
    """Search a stretch that begins at set ``first`` of the whole."""
    if len(history) < settings.fewest or history.time_utc_ns[0] == history.time_utc_ns[-1]:
        return []
    span = stretch(history, settings)
    verdict = judge(span, level)
    if verdict.p_value > level:
        return []
    lead, last = effects.preference(span), first + len(history)
    if lead > 0:
        return [_Place("drift", first, first, last, verdict.p_value, lead)]
    k = _likeliest(span)
    left, right = (
        _search(_part(history, which), settings, level / 2, begin)
        for which, begin in ((slice(0, k), first), (slice(k, None), first + k))
    )
    return [*left, _Place("step", first, first + k, last, verdict.p_value, -lead), *right]


def _likeliest(span: Stretch) -> int:
    return int(np.argmax(span.statistics(span.value).step.max(axis=-1))) + span.settings.smallest_side


def _fitted(history: ParameterHistory, settings: ChangeSettings, places: list[_Place], i: int) -> Change:
    """Fit one change on what lies between its neighbours: the other changes must not go into its size."""
    place = places[i]
    if place.kind == "drift":
        some = _part(history, slice(place.first, place.last))
        return _drift(some, stretch(some, settings), place.p_value, place.rival)
    before = max((q.split for q in places[:i] if q.kind == "step"), default=0)
    after = min((q.split for q in places[i + 1 :] if q.kind == "step"), default=len(history))
    beside = [q for q in places if q.kind == "drift" and place.split in (q.first, q.last)]
    level, extra = _levelled(history, settings, beside, place.split)
    some = _part(level, slice(before, after))
    span = stretch(some, settings)
    # beside a drift the sides have been made level for this very split
    k = place.split - before if beside else _likeliest(span)
    change = _step(some, span, k, place.p_value, place.rival)
    return replace(change, std=np.hypot(change.std, extra))


def _levelled(
    history: ParameterHistory, settings: ChangeSettings, drifts: list[_Place], split: int
) -> tuple[ParameterHistory, Float]:
    """Turn the drifts beside a step about their ends at the step, so that what is left there is the step.

    Returns
    -------
    ParameterHistory
    ndarray, shape (n_parameter,)
        What the drifts' own standard errors add to that of the step.
    """
    value, variance = history.value.copy(), np.zeros(len(history.names))
    for place in drifts:
        some = _part(history, slice(place.first, place.last))
        span = stretch(some, settings)
        rate, p = effects.drift_of(span, span.value), len(history.names)
        ends = span.years - (span.years[-1] if place.last == split else span.years[0])
        value[place.first : place.last] -= np.outer(ends, rate.change[p:] * span.scale)
        variance += (np.mean(ends) * rate.std[p:] * span.scale) ** 2
    level = ParameterHistory(history.names, history.units, history.time_utc_ns, value, history.covariance)
    return level, np.sqrt(variance)


def _part(history: ParameterHistory, which: slice) -> ParameterHistory:
    """Return some sets of a history."""
    h = history
    return ParameterHistory(h.names, h.units, h.time_utc_ns[which], h.value[which], h.covariance[which])


def _step(history: ParameterHistory, span: Stretch, k: int, p_value: float, rival: float) -> Change:
    time, level = history.time_utc_ns, span.settings.level
    intervals = effects.step_intervals(span, k, level)
    between = (int(time[k - 1]), int(time[k]))
    interval = (int(time[intervals.splits.min() - 1]), int(time[intervals.splits.max()]))
    return _change(
        "step", span, effects.step_at(span, span.value, k), intervals.width, between, interval, p_value, rival
    )


def _drift(history: ParameterHistory, span: Stretch, p_value: float, rival: float) -> Change:
    ends = (int(history.time_utc_ns[0]), int(history.time_utc_ns[-1]))
    width = effects.drift_intervals(span, span.settings.level).width
    return _change("drift", span, effects.drift_of(span, span.value), width, ends, ends, p_value, rival)


def _change(
    kind: Kind,
    span: Stretch,
    contrast: effects.Contrast,
    width: float,
    between: tuple[int, int],
    interval: tuple[int, int],
    p_value: float,
    rival: float,
) -> Change:
    p = span.value.shape[1]
    return Change(
        kind,
        between,
        interval,
        p_value,
        contrast.before[p:] * span.scale,
        contrast.change[p:] * span.scale,
        contrast.std[p:] * np.abs(span.scale),
        width,
        rival,
        tuple(
            (j, size * span.scale[j], std * abs(span.scale[j])) for j, size, std in effects.alone(span, contrast, width)
        ),
    )


def _without(history: ParameterHistory, changes: tuple[Change, ...]) -> ParameterHistory:
    """Return the history with the changes found taken off, so that what is left is scatter."""
    value = history.value.copy()
    for change in changes:
        time = history.time_utc_ns
        first, last = change.between_utc_ns
        if change.kind == "step":
            value[time >= last] -= change.change
        else:
            inside = np.clip(time, first, last) - first
            value -= inside[:, None] / (1e9 * 365.25 * 86400.0) * change.change
    return ParameterHistory(history.names, history.units, history.time_utc_ns, value, history.covariance)

"""From a diagnosis to what its report shows: every number and curve, nothing drawn yet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.misfit import where
from kempf.pipeline.diagnose.confusion_sets import alike
from kempf.pipeline.diagnose.diagnosis import Diagnosis, Step
from kempf.pipeline.diagnose.screen import Candidate, nuisance
from kempf.pipeline.diagnose.verdict import finding, sentences, sized, verdict
from kempf.pipeline.estimate.pooled_fit import Fit
from kempf.pipeline.estimate.sensitivity import N_HULL
from kempf.warehouse.segments import Segment
from kempf.workbench.report.content import (
    AddedVariable,
    MissingForce,
    RankedEffect,
    ReportContent,
    Rung,
    RunView,
)
from kempf.workbench.report.headline import headline, next_steps
from kempf.workbench.report.manoeuvre import run_view

#: effects in the confusion map
_MAPPED = 14
_LEVELS = ("lateral disturbance force, m/s² per √s", "disturbance moment, rad/s² per √s", "current, m/s per √s")


def gather(
    vessel: str,
    diagnosis: Diagnosis,
    segments: Sequence[Segment],
    logs: Mapping[str, str],
    ship: Mapping[str, str],
    provenance: Sequence[tuple[str, str]],
) -> ReportContent:
    """Gather what a report shows.

    Parameters
    ----------
    vessel : str
    diagnosis : Diagnosis
    segments : sequence of Segment
        Those of the diagnosed runs, in any order; a run bears its segment's id.
    logs : mapping of str to str
        File name by log id.
    ship : mapping of str to str
        What is told of the ship, such as length and draught with units.
    provenance : sequence of (str, str)
        Ids, versions and settings, as shown at the end.

    Returns
    -------
    ReportContent
    """
    by_name = {segment.segment_id: segment for segment in segments}
    first, last = diagnosis.steps[0], diagnosis.steps[-1]
    runs = [one.run for one in first.fit.runs]
    held = {run.name for run in diagnosis.held}
    everything = sorted([*runs, *diagnosis.held], key=lambda run: (run.start_utc_ns, run.name))
    views = tuple(
        run_view(run, by_name[run.name], logs, first, last, number, held_out=run.name in held)
        for number, run in enumerate(everything, start=1)
    )
    ranked = _ranked(diagnosis)
    shown = [c for c in first.screened if c.direction.size][:_MAPPED]
    return ReportContent(
        vessel=vessel,
        verdict=verdict(diagnosis),
        headline=headline(diagnosis),
        sentences=tuple(sentences(diagnosis)),
        next_steps=next_steps(diagnosis, vessel),
        ranked=ranked,
        names=tuple(c.effect.title for c in shown),
        alike=np.array([[alike(a, b) for b in shown] for a in shown]).reshape(len(shown), len(shown)),
        ladder=tuple(_rung(step, diagnosis) for step in diagnosis.steps),
        added_variables=tuple(_added_variables(diagnosis)),
        missing_before=_missing(views, diagnosis, plain=True),
        missing_after=_missing(views, diagnosis, plain=False),
        runs=views,
        where_before=_where(views, plain=True, held_out=False),
        where_after=_where(views, plain=False, held_out=False),
        where_held=_where(views, plain=False, held_out=True),
        ship=dict(ship),
        provenance=tuple(provenance),
    )


def _ranked(diagnosis: Diagnosis) -> tuple[RankedEffect, ...]:
    sets: dict[str, tuple[str | None, str]] = {}
    for number, step in enumerate(diagnosis.steps[1:], start=1):
        for candidate, one in step.chosen_from:
            sets[candidate.effect.name] = (f"S{number}", sized(candidate.effect, one))
    return tuple(_effect(diagnosis, one, *sets.get(one.effect.name, (None, ""))) for one in diagnosis.steps[0].screened)


def _effect(diagnosis: Diagnosis, one: Candidate, set_id: str | None, refitted: str) -> RankedEffect:
    told = finding(diagnosis, one)
    changes = tuple(
        (p.name, float(value), float(std), p.unit)
        for p, value, std in zip(one.effect.parameters, one.change, one.std, strict=True)
    )
    return RankedEffect(
        *(one.effect.name, one.effect.title, told.verdict, told.why, one.effect.separated_by, set_id),
        *(one.score, one.p_adjusted, one.absorption, changes, refitted),
    )


def _rung(step: Step, diagnosis: Diagnosis) -> Rung:
    used = np.any([one.levels_used()[:3] for one in step.fit.runs], axis=0)
    intensities = {name: float(value) for name, value, has in zip(_LEVELS, step.intensities, used, strict=True) if has}
    return Rung(
        added="plain model" if step.added is None else step.added.title,
        in_sample=np.array([run.relative_error for run in step.fitted]),
        held_out=np.array([run.relative_error for run in step.held]),
        intensities=intensities,
        log_likelihood=step.fit.log_likelihood,
        parameters=N_HULL + len(step.fit.model.names),
    )


def _added_variables(diagnosis: Diagnosis) -> list[AddedVariable]:
    """One for every effect that was added; with none, for the one that came nearest."""
    pairs: list[tuple[Fit, Candidate]] = []
    for before, step in zip(diagnosis.steps[:-1], diagnosis.steps[1:], strict=True):
        pairs.append((before.fit, step.chosen_from[0][0]))
    if not pairs:
        near = [c for c in diagnosis.steps[0].screened if c.direction.size]
        pairs = [(diagnosis.steps[0].fit, near[0])] if near else []
    found = []
    for fit, candidate in pairs:
        known = nuisance(fit.linearised, N_HULL + len(fit.model.names))
        left = known.clean(known.u[:, None])[:, 0]
        # the second half of each run's part tells of the spread, not of the innovations themselves
        mean = np.concatenate([np.arange(line.u.size) < line.u.size // 2 for line in fit.linearised])
        found.append(
            AddedVariable(candidate.effect.title, candidate.direction[mean], left[mean], float(candidate.score))
        )
    return found


def _missing(views: Sequence[RunView], diagnosis: Diagnosis, *, plain: bool) -> MissingForce:
    arm = diagnosis.fitted[0].ship.arm_per_m
    sway, yaw = [], []
    against: dict[str, list[Float]] = {"v, m/s": [], "r, deg/s": [], "rudder, deg": [], "heading, deg": []}
    for view in views:
        states = (view.plain if plain else view.full).states
        if not np.all(np.isfinite(states)):
            continue
        force, moment = states[:, 2], states[:, 2] * arm + states[:, 3]
        # a steady wind is no misfit
        sway.append(force - np.mean(force))
        yaw.append(moment - np.mean(moment))
        against["v, m/s"].append(states[:, 0])
        against["r, deg/s"].append(np.degrees(states[:, 1]))
        against["rudder, deg"].append(np.degrees(view.rudder_rad))
        against["heading, deg"].append(np.degrees(view.heading_rad) % 360.0)
    none = [np.zeros(0)]
    return MissingForce(
        np.concatenate(sway or none),
        np.concatenate(yaw or none),
        {name: np.concatenate(x or none) for name, x in against.items()},
    )


def _where(views: Sequence[RunView], *, plain: bool, held_out: bool) -> dict[str, Any]:
    looked = [(view.plain if plain else view.full).looked for view in views if view.held_out is held_out]
    return where(looked) if looked else {}

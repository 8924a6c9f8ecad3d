"""The sections of the page: each figure with the table beside it and the words that say how to read it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kempf.workbench.figures import (
    diagnosis_added_variable,
    diagnosis_confusion,
    diagnosis_correlations,
    diagnosis_coverage,
    diagnosis_effects,
    diagnosis_ladder,
    diagnosis_missing_force,
    diagnosis_overlay,
    diagnosis_strip,
    diagnosis_zigzag,
)
from kempf.workbench.figures.diagnosis_style import CHANNELS, bytes_of
from kempf.workbench.report.content import RankedEffect, ReportContent
from kempf.workbench.report.markup import badge, escape, figure, table
from kempf.workbench.report.numbers import with_interval

_NAMES = ("heading", "yaw_rate", "lateral_speed")
_VERDICTS = {"present": "present", "negligible": "too small", "not_testable": "not testable", "absent": "absent"}


def _p(text: str) -> str:
    return f"<p>{escape(text)}</p>\n"


def effects(content: ReportContent) -> str:
    """Ranked effects, and the whole catalogue as a table."""
    text = _p(
        "Every effect of the catalogue was tried beside the plain model without refitting it. The score tells how "
        "strongly the measurements ask for an effect; the expected change is its size if it were added, with a 95 % "
        "interval; the absorption is the share of it that the plain model imitates already: near 100 % nothing can be "
        "told. Coloured: effects that stood the refit; those of one colour and one set cannot be told apart."
    )
    if any(np.isfinite(one.score) for one in content.ranked):
        drawn = diagnosis_effects.draw_effects(content.ranked)
        text += figure(bytes_of(drawn), diagnosis_effects.describe_effects(content.ranked))
    rows = [_effect_row(one) for one in content.ranked]
    head = ("effect", "set", "verdict", "score", "p", "expected change", "absorption", "why")
    return text + table(head, rows, "All effects of the catalogue, by score", numeric=(3, 4, 6))


def _effect_row(one: RankedEffect) -> tuple[str, ...]:
    tested = np.isfinite(one.score)
    changes = "; ".join(f"{name} = {with_interval(value, std, unit)}" for name, value, std, unit in one.changes)
    return (
        *(one.title, one.set_id or "", _VERDICTS.get(one.verdict, one.verdict)),
        f"{one.score:.1f}" if tested else "",
        _p_value(one.p_adjusted) if tested else "",
        changes if tested else "",
        f"{100.0 * one.absorption:.{1 if one.absorption < 0.995 else 3}f} %" if np.isfinite(one.absorption) else "",
        one.why,
    )


def _p_value(p: float) -> str:
    return "below 0.0001" if p < 1e-4 else f"{p:.2g}"


def ladder(content: ReportContent) -> str:
    """Error ladder: figure and table."""
    drawn = diagnosis_ladder.draw_ladder(content.ladder)
    text = _p(
        "Left: how far a free run, which takes no measurement in, strays, in percent of the motion. "
        "Held-out manoeuvres were set aside before the first look and never fitted. Right: how strong the disturbances "
        "must be for the model to hold; an effect that is real takes work off them."
    )
    text += figure(bytes_of(drawn), diagnosis_ladder.describe_ladder(content.ladder))
    names = list(content.ladder[0].intensities)
    rows = []
    for number, rung in enumerate(content.ladder):
        rows.append(
            (
                *(str(number), rung.added if number == 0 else f"+ {rung.added}", str(rung.parameters)),
                *(_mean(rung.in_sample), _mean(rung.held_out), f"{rung.log_likelihood:.1f}"),
                *(f"{rung.intensities[name]:.3g}" for name in names),
            )
        )
    head = ("step", "model", "parameters", "fitted, %", "held out, %", "log-likelihood", *names)
    count = len(head)
    text += table(head, rows, "Free-run error (mean over manoeuvres) and disturbances", (0, *range(2, count)))
    return text + _caveat(content)


def _mean(values: np.ndarray) -> str:
    if not values.size:
        return "none held out"
    return f"{100.0 * float(np.mean(values)):.2f}" if np.all(np.isfinite(values)) else "runs away"


def _caveat(content: ReportContent) -> str:
    """Say plainly where held-out manoeuvres are few, or are predicted no better."""
    first, last = content.ladder[0].held_out, content.ladder[-1].held_out
    told = []
    if 0 < first.size < 3:
        told.append(
            f"{'One manoeuvre is' if first.size == 1 else 'Two manoeuvres are'} held out: too few to tell a small "
            "change of the held-out error from chance."
        )
    if content.improved and first.size and float(np.mean(last)) > float(np.mean(first)):
        told.append(
            f"The held-out free run strays no less with the effects ({100 * np.mean(last):.2f} %) than without "
            f"({100 * np.mean(first):.2f} %): the evidence lies in the likelihood of held-out measurements and in the "
            "disturbances, not in this error."
        )
    return "".join(_p(one) for one in told)


def prediction(content: ReportContent) -> str:
    """Measured over predicted, held-out manoeuvres first, and fit % at every horizon."""
    text = _p(
        "Fit is 100 (1 - |y - ŷ| / |y - mean y|) in percent, 100 being perfect. Horizons: one step takes every "
        "measurement in; 10 s and 60 s ahead go without for so long; the free run takes none in. The initial state and "
        "a constant wind force and current of each free run are fitted to that manoeuvre, as few for every model; "
        "at the other horizons the filter finds them on the way, which is why 60 s ahead may do worse than a free run."
    )
    text += _fit_table(content)
    for view in sorted(content.runs, key=lambda one: not one.held_out):
        text += f"<h3>{escape(view.label)} {badge(held_out=view.held_out)} horizon: free run</h3>\n"
        drawn = diagnosis_overlay.draw_overlay(view)
        text += figure(bytes_of(drawn), diagnosis_overlay.describe_overlay(view))
    return text


def _fit_table(content: ReportContent) -> str:
    head = ["manoeuvre", "", "horizon"]
    channels = [n for n in _NAMES if any(n in f for r in content.runs for f in r.plain.fit_percent.values())]
    words = {name: CHANNELS[2 - k][0] for k, name in enumerate(_NAMES)}
    models = ["plain", "with effects"] if content.improved else ["plain"]
    head += [f"{words[name]}, {model}" for name in channels for model in models]
    rows = []
    for view in sorted(content.runs, key=lambda one: not one.held_out):
        courses = [view.plain, view.full][: len(models)]
        for horizon in view.plain.fit_percent:
            row = [view.label.split(",")[0], badge(held_out=view.held_out), horizon]
            for name in channels:
                fits = [course.fit_percent.get(horizon, {}).get(name) for course in courses]
                row += ["" if fit is None else f"{fit:.1f}" for fit in fits]
            rows.append(row)
    return table(head, rows, "Fit in percent", numeric=range(3, len(head)))


def innovations(content: ReportContent) -> str:
    """Innovation strips of all runs."""
    text = _p(
        "What each measurement tells beyond its prediction one step ahead, in standard deviations that the model gives "
        "it: 95 of 100 belong between the dashed lines, without a pattern. Noise levels of a held-out manoeuvre are "
        "the mean of the fitted ones. Points beyond 5 are drawn at the edge."
    )
    for view in content.runs:
        text += f"<h3>{escape(view.label)} {badge(held_out=view.held_out)} horizon: one step</h3>\n"
        text += figure(bytes_of(diagnosis_strip.draw_strip(view)), diagnosis_strip.describe_strip(view))
    return text


def where(content: ReportContent) -> str:
    """Where the model fails: phases, sides, what stands out, the worst stretches."""
    text = _p(
        "Root mean square of the whitened innovations, one step ahead, of fitted manoeuvres: 1 when a model is right. "
        "The band is where it lies then with probability 99 %."
    )
    rows = []
    for of, words in (("by_phase", "phase"), ("by_side", "side"), ("by_run", "manoeuvre")):
        labels = {view.segment_id: view.label.split(",")[0] for view in content.runs}
        for name, one in content.where_after[of].items():
            if not one["n"]:
                continue
            last = _rms(one)
            row = [words, labels.get(name, name.replace("_", " ")), str(one["n"])]
            row += [_rms(content.where_before[of][name]), last] if content.improved else [last]
            rows.append([*row, f"{one['band'][0]:.2f} to {one['band'][1]:.2f}", "outside" if one["outside"] else ""])
    models = ["plain model", "with effects"] if content.improved else ["plain model"]
    head = ["by", "", "innovations", *models, "band", ""]
    text += table(head, rows, "Whitened innovations by phase, side and manoeuvre", range(2, 3 + len(models)))
    stands = [
        (
            *(one["of"].removeprefix("by_").replace("_", " "), one["which"].replace("_", " ")),
            *(one["channel"].replace("_", " "), str(one["n"]), _rms(one), _p_value(one["p_adjusted"])),
        )
        for one in content.where_after["stands_out"]
    ]
    if stands:
        head = ["by", "which", "channel", "innovations", "rms", "p"]
        text += table(head, stands, "What stands out under the last model, of all groups and bins", (3, 4, 5))
    else:
        text += _p("No phase, side, manoeuvre or bin stands out under the last model.")
    return text + _stretches(content)


def _rms(one: Mapping[str, Any]) -> str:
    return f"{one['whitened_rms']:.2f}"


def _stretches(content: ReportContent) -> str:
    labels = {view.segment_id: view.label.split(",")[0] for view in content.runs}
    rows = []
    for sample in (content.where_held, content.where_after):
        for one in sample.get("worst", ())[:10]:
            size = (
                f"{one['whitened_rms']:.1f} standard deviations"
                if one["measure"] == "one step"
                else f"{one['free_run_rms']:.3g} {one['unit']}"
            )
            rows.append(
                (
                    *(labels[one["run"]], badge(held_out=sample is content.where_held), one["measure"]),
                    *(one["channel"].replace("_", " "), one["phase"].replace("_", " ")),
                    *(f"{one['start_s']:.0f} to {one['end_s']:.0f}", one["start"], size),
                )
            )
    head = ("manoeuvre", "", "horizon", "channel", "phase", "s", "begins, UTC", "rms")
    return table(head, rows, "The worst stretches, to look at in the logs")


def correlations(content: ReportContent) -> str:
    """Auto- and cross-correlations, fitted manoeuvres alone."""
    runs = [view for view in content.runs if not view.held_out]
    text = _p(
        f"Over the {len(runs)} fitted manoeuvres. If a model is right, its innovations know nothing of their past, "
        "nor of rudder, heading, speed or wind: 99 of 100 values lie in the grey band, 2.58 / √N."
    )
    before, after = content.where_before["correlations"], content.where_after["correlations"]
    drawn = diagnosis_correlations.draw_correlations(before, after, improved=content.improved)
    text += figure(bytes_of(drawn), diagnosis_correlations.describe_correlations(after))
    first, last = diagnosis_correlations.pairs(before), diagnosis_correlations.pairs(after)
    rows = []
    for key, one in last.items():
        row = [key[0].replace("_", " "), diagnosis_correlations.WORDS[key[1]], str(len(one["lag_s"]))]
        row += [str(first[key]["outside"]), str(one["outside"])] if content.improved else [str(one["outside"])]
        rows.append([*row, f"{one['largest']:+.3f} at {one['largest_lag_s']:.0f} s", f"{one['band']:.3f}"])
    models = ["outside, plain", "outside, with effects"] if content.improved else ["outside"]
    head = ["innovation of", "with", "lags", *models, "largest", "band"]
    return text + table(head, rows, "Lags outside the band", numeric=range(2, len(head)))


def added_variables(content: ReportContent) -> str:
    """Added-variable plots."""
    if not content.added_variables:
        return ""
    which = "each effect that was added" if content.improved else "the effect that came nearest, which was not added"
    text = _p(
        f"For {which}: what is left of the innovations against what the effect would explain of them, without what "
        "the fitted parameters can imitate. Points along the line are evidence; a cloud about the level is none."
    )
    drawn = diagnosis_added_variable.draw_added_variable(content.added_variables)
    return text + figure(bytes_of(drawn), diagnosis_added_variable.describe_added_variable(content.added_variables))


def confusion(content: ReportContent) -> str:
    """Confusion map."""
    if len(content.names) < 2:
        return ""
    text = _p(
        "How much of what one effect would explain another would explain alike, for the highest scores beside the "
        "plain model. Dark pairs cannot be told apart by these manoeuvres."
    )
    drawn = diagnosis_confusion.draw_confusion(content.names, content.alike)
    text += figure(bytes_of(drawn), diagnosis_confusion.describe_confusion(content.names, content.alike))
    apart = [one for one in content.ranked if one.set_id and one.separated_by]
    if apart:
        rows = [(one.set_id or "", one.title, one.refitted, one.separated_by) for one in apart]
        text += table(("set", "effect", "refitted", "told apart by"), rows, "Effects that stood the refit, by set")
    return text


def missing_force(content: ReportContent) -> str:
    """Missing force and moment."""
    text = _p(
        "What the disturbances must lend the model at every instant, given all measurements, less the mean of "
        "each run: dots, with medians and quartiles over bins. A slope or a bend against one of these is the shape of "
        "the force that the model lacks; where the model has it, nothing but a level cloud is left."
    )
    before, after = content.missing_before, content.missing_after if content.improved else content.missing_before
    drawn = diagnosis_missing_force.draw_missing_force(before, after)
    return text + figure(bytes_of(drawn), diagnosis_missing_force.describe_missing_force(before, after))


def coverage(content: ReportContent) -> str:
    """Coverage maps."""
    text = _p("Outside of what was sailed, the model is an extrapolation.")
    drawn = diagnosis_coverage.draw_coverage(content.runs)
    return text + figure(bytes_of(drawn), diagnosis_coverage.describe_coverage(content.runs))


def zigzags(content: ReportContent) -> str:
    """Zigzag plots, overshoots measured and predicted, criteria."""
    text = ""
    for view in content.runs:
        text += f"<h3>{escape(view.label)} {badge(held_out=view.held_out)}</h3>\n"
        text += figure(bytes_of(diagnosis_zigzag.draw_zigzag(view)), diagnosis_zigzag.describe_zigzag(view))
        text += _overshoots(content, view.segment_id)
    rows = []
    for view in content.runs:
        for name, one in view.imo.items():
            said = {True: "met", False: "not met", None: "not applicable"}[one.get("passed")]
            rows.append(
                (
                    *(view.label.split(",")[0], name, _degrees(one.get("value_deg")), _degrees(one.get("limit_deg"))),
                    *(said, one.get("why") or ""),
                )
            )
    head = ("manoeuvre", "criterion", "measured, deg", "limit, deg", "", "why not")
    return text + table(head, rows, "Criteria of IMO resolution MSC.137(76), 5.3.3", numeric=(2, 3))


def _overshoots(content: ReportContent, segment_id: str) -> str:
    view = next(one for one in content.runs if one.segment_id == segment_id)
    rows = []
    for k, one in enumerate(view.plain.overshoots):
        side = "starboard" if one.side > 0 else "port"
        row = [str(one.number), side, f"{one.measured_deg:.1f}", _degrees(one.predicted_deg)]
        if content.improved:
            row.append(_degrees(view.full.overshoots[k].predicted_deg))
        rows.append(row)
    if not rows:
        return ""
    head = ["overshoot", "side", "measured, deg", "plain model, deg"] + ["with effects, deg"] * content.improved
    return table(head, rows, "Overshoots, measured and predicted (free run)", numeric=(0, *range(2, len(head))))


def _degrees(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def provenance(content: ReportContent) -> str:
    """List inputs, versions and settings."""
    rows = list(content.provenance)
    rows += [
        (f"{view.label.split(',')[0]}, {'held out' if view.held_out else 'fitted'}", f"{view.segment_id} of {view.log}")
        for view in content.runs
    ]
    return table(("what", "which"), rows, "Inputs, versions and settings")

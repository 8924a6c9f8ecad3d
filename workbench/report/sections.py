"""The sections of the page: each figure with the table beside it. Titles and leads are those of the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

from kempf.schemas.diagnosis_evidence import FittedParameter
from kempf.schemas.enumeration import as_words
from kempf.schemas.instants import second
from kempf.schemas.motion_channel import MOTION
from kempf.workbench.effect_row import EffectRow
from kempf.workbench.figures import (
    diagnosis_added_variable,
    diagnosis_confusion,
    diagnosis_correlations,
    diagnosis_coverage,
    diagnosis_effects,
    diagnosis_ladder,
    diagnosis_overlay,
    diagnosis_strip,
    diagnosis_unmodelled,
    diagnosis_zigzag,
)
from kempf.workbench.figures.diagnosis_style import bytes_of
from kempf.workbench.numbers import with_error
from kempf.workbench.report.charts import chart_of
from kempf.workbench.report.content import (
    Block,
    Cell,
    HeadingBlock,
    PictureBlock,
    ReportContent,
    SampleBadge,
    ShownManoeuvre,
    TableBlock,
    TextBlock,
)

_CHANNELS = ("heading", "yaw_rate", "lateral_speed")


def _picture(figure: Any, alt: str, caption: str) -> PictureBlock:
    return PictureBlock(bytes_of(figure), alt, caption)


def _models(content: ReportContent) -> tuple[str, ...]:
    words = content.wording
    return (words.first_model, words.last_model) if content.evidence.improved else (words.first_model,)


def _held_out_first(content: ReportContent) -> list[ShownManoeuvre]:
    return sorted(content.manoeuvres, key=lambda manoeuvre: not manoeuvre.evidence.held_out)


def effects(content: ReportContent) -> list[Block]:
    """Ranked effects, and the whole catalogue as a table."""
    first = content.wording.diagnosed_model
    blocks: list[Block] = []
    if any(row.tested for row in content.effects):
        blocks.append(
            _picture(
                diagnosis_effects.draw_effects(content.effects),
                diagnosis_effects.describe_effects(content.effects, first),
                f"Effects with the highest scores beside the {first}.",
            )
        )
    head = ("effect", "set", "verdict", "score", "p", "expected size ± 1 s.e.", "absorption", "why")
    rows = [_effect_row(row) for row in content.effects]
    return [*blocks, TableBlock("All effects of the catalogue, by score", head, rows, numeric=(3, 4, 6))]


def _effect_row(row: EffectRow) -> tuple[str, ...]:
    sizes = "; ".join(
        # a value stays on one line
        f"{change.name} = {with_error(change.value, change.std, change.unit)}".replace(" ", "\u00a0")
        for change in row.changes
    )
    absorbed = f"{100.0 * row.absorption:.{1 if row.absorption < 0.995 else 3}f} %" if isfinite(row.absorption) else ""
    return (
        *(row.title, row.set_id, row.verdict),
        f"{row.score:.1f}" if row.tested else "",
        _p_value(row.p_adjusted) if row.tested else "",
        sizes if row.tested else "",
        absorbed,
        row.why,
    )


def _p_value(p: float) -> str:
    return "< 0.0001" if p < 1e-4 else f"{p:.2g}"


def parameters(content: ReportContent) -> list[Block]:
    """Parameters of the first model and of the last, with their standard errors."""
    models = content.evidence.models
    shown = (models[0], models[-1]) if content.evidence.improved else (models[0],)
    columns: dict[str, tuple[FittedParameter, ...]] = {}
    for called, model in zip(_models(content), shown, strict=True):
        columns[f"{called}, ± 1 s.e."] = model.parameters
        if model.leg_parameters:
            columns[f"{called}, fitted to legs, ± 1 s.e."] = model.leg_parameters
    values = [{p.name: with_error(p.value, p.std, p.unit) for p in column} for column in columns.values()]
    rows = [(p.name, *(column.get(p.name, "-") for column in values)) for p in shown[-1].parameters]
    head = ("parameter", *columns)
    unsure = [name for name, model in zip(_models(content), shown, strict=True) if not model.converged]
    notes = [TextBlock(f"Not converged, the iterations allowed ran out: {name}.") for name in unsure]
    caption = "Parameters in SI units, angles in degrees, value ± one standard error"
    return [TableBlock(caption, head, rows, range(1, len(head))), *notes]


def ladder(content: ReportContent) -> list[Block]:
    """Error ladder: figure and table."""
    models, first = content.evidence.models, content.wording.first_model
    middle = "median" if content.evidence.by_legs else "mean"
    drawn = _picture(
        diagnosis_ladder.draw_ladder(models, first),
        diagnosis_ladder.describe_ladder(models, first),
        f"Free-run error by manoeuvre and its {middle} (beyond three times the largest {middle} at the edge); "
        "disturbances that each model needs.",
    )
    rows = []
    for number, model in enumerate(models):
        rows.append(
            (
                *(str(number), f"+ {model.added}" if model.added else first, str(len(model.parameters))),
                *(_error(model.fitted_error), _error(model.held_out_error, any_there=model.held_out_errors.size > 0)),
                f"{model.log_likelihood:.1f}",
                *(f"{level.intensity:.3g}" for level in model.disturbances),
            )
        )
    levels = [f"{level.name}, {level.unit}" for level in models[0].disturbances]
    head = ("step", "model", "parameters", "fitted, %", "held out, %", "log-likelihood", *levels)
    caption = f"Free-run error ({middle} over manoeuvres, in percent of the motion) and disturbances"
    return [drawn, TableBlock(caption, head, rows, (0, *range(2, len(head)))), *_caveats(content)]


def _error(share: float, *, any_there: bool = True) -> str:
    if not any_there:
        return "none held out"
    return f"{100.0 * share:.2f}" if isfinite(share) else "diverges"


def _caveats(content: ReportContent) -> list[Block]:
    """Say plainly where held-out manoeuvres are few."""
    many = content.evidence.models[0].held_out_errors.size
    if not 0 < many < 3:
        return []
    held = "One manoeuvre is" if many == 1 else "Two manoeuvres are"
    return [TextBlock(f"{held} held out: too few to distinguish a small change of the held-out error from chance.")]


def prediction(content: ReportContent) -> list[Block]:
    """Measured over predicted, held-out manoeuvres first, and fit % at every horizon."""
    first, last = content.wording.first_model, content.wording.last_model
    blocks: list[Block] = [_fit_table(content)]
    for manoeuvre in _held_out_first(content):
        blocks += [
            HeadingBlock(manoeuvre.label, SampleBadge(manoeuvre.evidence.held_out)),
            chart_of(
                manoeuvre.evidence,
                manoeuvre.label,
                _picture(
                    diagnosis_overlay.draw_overlay(manoeuvre.evidence, first, last),
                    diagnosis_overlay.describe_overlay(manoeuvre.evidence, manoeuvre.label, first, last),
                    f"{manoeuvre.short}, measured (dots) over predicted, horizon free run, with the rudder: "
                    f"by the {last} (line)"
                    f"{f', by the {first} (dashed)' if manoeuvre.evidence.after is not None else ''}.",
                ),
            ),
        ]
    return blocks


def _fit_table(content: ReportContent) -> TableBlock:
    every = [fits for manoeuvre in content.manoeuvres for fits in manoeuvre.evidence.before.fit_percent.values()]
    channels = [name for name in _CHANNELS if any(name in fits for fits in every)]
    head = ["manoeuvre", "sample", "horizon"]
    head += [f"{MOTION[name].words}, {model}" for name in channels for model in _models(content)]
    rows: list[list[Cell]] = []
    for manoeuvre in _held_out_first(content):
        predicted = [each for each in (manoeuvre.evidence.before, manoeuvre.evidence.after) if each is not None]
        for horizon in manoeuvre.evidence.before.fit_percent:
            row: list[Cell] = [manoeuvre.short, SampleBadge(manoeuvre.evidence.held_out), horizon]
            for name in channels:
                fits = [each.fit_percent.get(horizon, {}).get(name) for each in predicted]
                row += ["" if fit is None else f"{fit:.1f}" for fit in fits]
            rows.append(row)
    return TableBlock("Fit in percent, by horizon", head, rows, range(3, len(head)))


def innovations(content: ReportContent) -> list[Block]:
    """One-step errors of all manoeuvres in time."""
    first, last = content.wording.first_model, content.wording.last_model
    blocks: list[Block] = []
    for manoeuvre in content.manoeuvres:
        blocks += [
            HeadingBlock(manoeuvre.label, SampleBadge(manoeuvre.evidence.held_out)),
            _picture(
                diagnosis_strip.draw_strip(manoeuvre.evidence, first, last),
                diagnosis_strip.describe_strip(manoeuvre.evidence, manoeuvre.label, first, last),
                f"{manoeuvre.short}, whitened innovations, horizon one step.",
            ),
        ]
    return blocks


def where(content: ReportContent) -> list[Block]:
    """One-step errors by phase, side and manoeuvre; what stands out; the worst windows."""
    places, names, rows = content.evidence.misfit, _names(content), []
    for group, words in (("by_phase", "phase"), ("by_side", "side"), ("by_run", "manoeuvre")):
        for name, last in places.after.get(group, {}).items():
            if not last["n"]:
                continue
            row = [words, names.get(name, as_words(name)), str(last["n"])]
            row += [_rms(places.before[group][name]), _rms(last)] if content.evidence.improved else [_rms(last)]
            rows.append([*row, f"{last['band'][0]:.2f} to {last['band'][1]:.2f}", "outside" if last["outside"] else ""])
    head = ["by", "group", "innovations", *_models(content), "band", "outside"]
    blocks: list[Block] = [TableBlock("Whitened innovations, root mean square", head, rows, range(2, len(head) - 2))]
    standing = [
        (
            *(as_words(place["of"].removeprefix("by_")), as_words(place["which"])),
            *(as_words(place["channel"]), str(place["n"]), _rms(place), _p_value(place["p_adjusted"])),
        )
        for place in places.after.get("stands_out", ())
    ]
    if standing:
        head = ["by", "group", "channel", "innovations", "rms", "p"]
        caption = f"Groups with the largest one-step errors under the {content.wording.last_model}"
        blocks.append(TableBlock(caption, head, standing, (3, 4, 5)))
    else:
        blocks.append(TextBlock("No phase, side, manoeuvre or bin stands out under the last model."))
    return [*blocks, _worst(content)]


def _names(content: ReportContent) -> dict[str, str]:
    return {manoeuvre.evidence.segment_id: manoeuvre.short for manoeuvre in content.manoeuvres}


def _rms(group: Mapping[str, Any]) -> str:
    return f"{group['whitened_rms']:.2f}"


def _worst(content: ReportContent) -> TableBlock:
    names, rows = _names(content), []
    for places, held in ((content.evidence.misfit.held_out, True), (content.evidence.misfit.after, False)):
        for window in places.get("worst", ())[:10]:
            size = (
                f"{window['whitened_rms']:.1f} standard deviations"
                if window["measure"] == "one step"
                else f"{window['free_run_rms']:.3g} {window['unit']}"
            )
            rows.append(
                (
                    *(names[window["run"]], SampleBadge(held), window["measure"]),
                    *(as_words(window["channel"]), as_words(window["phase"] or "")),
                    *(f"{window['start_s']:.0f} to {window['end_s']:.0f}", second(window["start"]), size),
                )
            )
    head = ("manoeuvre", "sample", "horizon", "channel", "phase", "time, s", "begins, UTC", "rms error")
    return TableBlock("The windows with the largest errors, to look at in the logs", head, rows)


def correlations(content: ReportContent) -> list[Block]:
    """Auto- and cross-correlations, fitted manoeuvres alone."""
    places, improved = content.evidence.misfit, content.evidence.improved
    if not places.before or not places.after:
        return []
    before, after = places.before["correlations"], places.after["correlations"]
    words = content.wording
    drawn = diagnosis_correlations.draw_correlations(
        before, after, words.first_model, words.last_model, improved=improved
    )
    caption = "Correlations of the innovations (rows) with themselves and with the inputs (columns)."
    picture = _picture(drawn, diagnosis_correlations.describe_correlations(after), caption)
    first, last = diagnosis_correlations.pairs(before), diagnosis_correlations.pairs(after)
    rows = []
    for key, pair in last.items():
        row = [as_words(key[0]), diagnosis_correlations.WORDS[key[1]], str(len(pair["lag_s"]))]
        row += [str(first[key]["outside"]), str(pair["outside"])] if improved else [str(pair["outside"])]
        rows.append([*row, f"{pair['largest']:+.3f} at {pair['largest_lag_s']:.0f} s", f"{pair['band']:.3f}"])
    outside = [f"outside, {model}" for model in _models(content)]
    head = ["innovation of", "with", "lags", *outside, "largest", "band"]
    return [picture, TableBlock("Lags outside the band", head, rows, numeric=range(2, len(head)))]


def added_variables(content: ReportContent) -> list[Block]:
    """Added-variable plots."""
    shown = content.evidence.added_variables
    if not shown:
        return []
    return [
        _picture(
            diagnosis_added_variable.draw_added_variable(shown),
            diagnosis_added_variable.describe_added_variable(shown),
            "Added-variable plot: what is left of the innovations over what the effect would explain.",
        )
    ]


def confusion(content: ReportContent) -> list[Block]:
    """Confusion map, and how to distinguish what is claimed."""
    confused = content.evidence.confusion
    if len(confused.titles) < 2:
        return []
    blocks: list[Block] = [
        _picture(
            diagnosis_confusion.draw_confusion(confused),
            diagnosis_confusion.describe_confusion(confused),
            "Confusion map, in percent: 100 where two effects would explain the same.",
        )
    ]
    rows = []
    for group in content.sets:
        for name in group["effects"]:
            candidate = content.evidence.candidates[name]
            sizes = "; ".join(
                f"{p.name.rpartition('.')[2]} = {with_error(p.value, p.std, p.unit)}" for p in candidate.refitted
            )
            rows.append((group["set_id"], as_words(name), sizes, candidate.separated_by))
    if rows:
        head = ("set", "effect", "refitted, ± 1 s.e.", "distinguished by")
        blocks.append(TableBlock("Effects that the refit confirmed, by confusion set", head, rows))
    return blocks


def unmodelled(content: ReportContent) -> list[Block]:
    """Unmodelled acceleration."""
    shown = content.evidence.unmodelled_before, content.evidence.unmodelled_after
    names = content.wording.first_model, content.wording.last_model
    return [
        _picture(
            diagnosis_unmodelled.draw_unmodelled(*shown, *names),
            diagnosis_unmodelled.describe_unmodelled(*shown, *names),
            "Unmodelled acceleration over lateral speed, yaw rate, rudder and heading; medians and quartiles.",
        )
    ]


def coverage(content: ReportContent) -> list[Block]:
    """Coverage maps."""
    return [
        _picture(
            diagnosis_coverage.draw_coverage([manoeuvre.evidence for manoeuvre in content.manoeuvres]),
            diagnosis_coverage.describe_coverage(content.evidence.ranges),
            "Motion, rudder and speed of all manoeuvres.",
        )
    ]


def zigzags(content: ReportContent) -> list[Block]:
    """Draw the manoeuvres; list overshoots measured and predicted, and the criteria of zigzags."""
    first, last = content.wording.first_model, content.wording.last_model
    blocks: list[Block] = []
    for manoeuvre in content.manoeuvres:
        allowed = diagnosis_zigzag.limits(manoeuvre.imo)
        blocks += [
            HeadingBlock(manoeuvre.label, SampleBadge(manoeuvre.evidence.held_out)),
            _picture(
                diagnosis_zigzag.draw_zigzag(manoeuvre.evidence, manoeuvre.psi0_deg, allowed, first, last),
                diagnosis_zigzag.describe_zigzag(manoeuvre.evidence, manoeuvre.label),
                f"{manoeuvre.short}: heading from the base course, measured and predicted in free run, and rudder.",
            ),
            *_overshoots(content, manoeuvre),
        ]
    rows = []
    for manoeuvre in content.manoeuvres:
        for name, criterion in manoeuvre.imo.items():
            result = {True: "met", False: "not met", None: "not applicable"}[criterion.get("passed")]
            value, limit = _degrees(criterion.get("value_deg")), _degrees(criterion.get("limit_deg"))
            rows.append((manoeuvre.short, name, value, limit, result, criterion.get("why") or ""))
    head = ("manoeuvre", "criterion", "measured, deg", "limit, deg", "result", "why not")
    if not rows:
        return blocks
    return [*blocks, TableBlock("Criteria of IMO resolution MSC.137(76), 5.3.3", head, rows, numeric=(2, 3))]


def _overshoots(content: ReportContent, manoeuvre: ShownManoeuvre) -> list[Block]:
    predicted = [each.overshoots for each in (manoeuvre.evidence.before, manoeuvre.evidence.after) if each is not None]
    measured = next((pairs for pairs in predicted if pairs), ())
    rows = []
    for k, pair in enumerate(measured):
        side = "starboard" if pair.side > 0 else "port"
        columns = [_degrees(pairs[k].predicted_deg) if pairs else "diverges" for pairs in predicted]
        rows.append((str(pair.number), side, f"{pair.measured_deg:.1f}", *columns))
    if not rows:
        return []
    head = ("overshoot", "side", "measured, deg", *(f"{name}, deg" for name in _models(content)))
    caption = f"{manoeuvre.short}: overshoots, measured and predicted in free run"
    return [TableBlock(caption, head, rows, numeric=(0, *range(2, len(head))))]


def _degrees(value: float | None) -> str:
    return "" if value is None or not isfinite(value) else f"{value:.1f}"


def provenance(content: ReportContent) -> list[Block]:
    """List inputs, versions and settings."""
    rows = list(content.provenance)
    rows += [
        (
            f"{manoeuvre.short}, {SampleBadge(manoeuvre.evidence.held_out).text}",
            f"{manoeuvre.evidence.segment_id} of {manoeuvre.log}",
        )
        for manoeuvre in content.manoeuvres
    ]
    return [TableBlock("Inputs, versions and settings", ("what", "which"), rows)]

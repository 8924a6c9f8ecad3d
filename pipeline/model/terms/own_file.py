"""An effect of a person's own, written as a file: YAML with formulas; no code in it is ever run."""

from __future__ import annotations

from typing import Any

import yaml
from pydantic import ValidationError

from kempf.pipeline.model.terms.effect import Effect, ExtraState, Parameter
from kempf.pipeline.model.terms.expression import FUNCTIONS, compiled, names_in
from kempf.pipeline.model.terms.ordinary import require_ordinary
from kempf.pipeline.model.terms.own import require_name
from kempf.pipeline.model.terms.places import places
from kempf.pipeline.model.terms.symbols import CHANNEL_SYMBOLS, SYMBOLS
from kempf.schemas.effect import EffectFile
from kempf.schemas.errors import UsageError

_LONGEST = 50_000
_DEEPEST = 20
_OPENS = (
    *(yaml.FlowSequenceStartToken, yaml.FlowMappingStartToken),
    *(yaml.BlockSequenceStartToken, yaml.BlockMappingStartToken),
)
_CLOSES = (yaml.FlowSequenceEndToken, yaml.FlowMappingEndToken, yaml.BlockEndToken)
_NEXT = "Mend it; docs/effects.md has an effect file that works."


def from_file(text: str, where: str) -> Effect:
    """Read an effect file.

    Parameters
    ----------
    text : str
        Its content, YAML.
    where : str
        Its name, for the messages.

    Returns
    -------
    Effect
        Of the group ``own``.

    Raises
    ------
    UsageError
        ``effect_file_invalid``: one message that names the file and the key, whatever is wrong with it.
    """
    content = _content(text, where)
    try:
        told = EffectFile.model_validate(content)
    except ValidationError as error:
        faults = [_fault(e) for e in error.errors()]
        raise _wrong(where, "; ".join(faults[:5]), {"faults": faults}) from error
    try:
        require_name(told.name)
        _check_names(told)
        effect = _effect(told)
        _check_keys(effect)
        require_ordinary(effect)
    except UsageError as error:
        raise _wrong(
            where, error.message.rstrip("."), {"code": error.code, **error.details}, error.next_step
        ) from error
    return effect


def _content(text: str, where: str) -> Any:
    if len(text) > _LONGEST:
        raise _wrong(where, f"it is {len(text)} characters long, {_LONGEST} is the most")
    try:
        # one alias for another for another stands for more than memory holds; nobody needs one here
        depth = 0
        for token in yaml.scan(text, Loader=yaml.SafeLoader):
            if isinstance(token, yaml.AliasToken):
                raise _wrong(where, "it holds an alias ('*name')")
            depth += isinstance(token, _OPENS) - isinstance(token, _CLOSES)
            if depth > _DEEPEST:
                raise _wrong(where, "it is nested too deep to be read")
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, LookupError, AttributeError, OverflowError, TypeError) as error:
        if isinstance(error, UsageError):
            raise
        raise _wrong(where, f"it is not valid YAML: {' '.join(str(error).split())[:300]}") from error
    if not isinstance(content, dict):
        raise _wrong(where, f"expected keys such as 'name' and 'terms', found {type(content).__name__}")
    return content


def _fault(error: Any) -> str:
    place = ".".join(str(part) for part in error["loc"])
    return f"{place[:80] or 'file'}: {error['msg'].removeprefix('Value error, ')}"


def _check_names(told: EffectFile) -> None:
    for name in told.parameters:
        if name in SYMBOLS or name in FUNCTIONS:
            raise UsageError(
                "effect_parameter",
                f"parameters.{name}: {name!r} already stands for something else in a formula.",
                "Call the parameter c, k or tau, say.",
            )


def _effect(told: EffectFile) -> Effect:
    formulas = [*told.terms.values(), *(f for s in told.states.values() for f in (s.derivative, s.noise))]
    spoken = {name for formula in formulas for name in names_in(formula)}
    needs = [channel for symbol, channel in CHANNEL_SYMBOLS.items() if symbol in spoken]
    return Effect(
        name=told.name,
        title=told.title or told.name.replace("_", " "),
        group="own",
        plain=told.plain,
        equation=told.equation or "; ".join(f"{target}: {text}" for target, text in told.terms.items()),
        reference=told.reference,
        parameters=tuple(Parameter(n, p.unit, p.low, p.high, p.steps, p.meaning) for n, p in told.parameters.items()),
        terms=dict(told.terms),
        states=tuple(ExtraState(n, s.derivative, s.noise, s.initial_std) for n, s in told.states.items()),
        needs=tuple(dict.fromkeys([*needs, *told.needs])),
        confounded_with=told.confounded_with,
        separated_by=told.separated_by,
    )


def _check_keys(effect: Effect) -> None:
    """Compile every formula here first, so that the message names its key, and see that every parameter is used."""
    own = [state.name for state in effect.states]
    known = [name for name in SYMBOLS if name not in ("m1", "m2", "m3", "m4") or name in own]
    variables = {name: i for i, name in enumerate([*known, *(p.name for p in effect.parameters)])}
    used: set[str] = set()
    for place in places(effect):
        key = f"states.{place.name}" if "." in place.name else f"terms.{place.name}"
        try:
            compiled(place.text, variables)
        except UsageError as error:
            raise UsageError(error.code, f"{key}: {error.message}", error.next_step, error.details) from error
        used |= set(names_in(place.text))
    idle = [p.name for p in effect.parameters if p.name not in used]
    if idle:
        raise UsageError(
            "effect_parameter",
            f"parameters.{idle[0]}: no formula speaks of it.",
            "Use it in a formula, or leave it out.",
        )


def _wrong(where: str, why: str, details: dict[str, Any] | None = None, next_step: str = _NEXT) -> UsageError:
    return UsageError(
        "effect_file_invalid",
        f"{where} is not a valid effect file: {why}.",
        next_step,
        {"file": where, **(details or {})},
    )

"""An effect of a user's own, as a formula, ``yaw: r*abs(r)``, or as a file.

Both are checked here for what the tests ask of the catalogue's files.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches

from kempf.pipeline.model.terms.expression import FUNCTIONS, compiled, names_in
from kempf.pipeline.model.terms.ordinary import require_ordinary
from kempf.pipeline.model.terms.own_parameters import parameters_of
from kempf.pipeline.model.terms.places import KINDS, Place, allowed, places, require_in_place, symbols_beside
from kempf.schemas.effect import Effect
from kempf.schemas.effect_file import invalid, read
from kempf.schemas.errors import UsageError
from kempf.schemas.symbols import SYMBOLS, TARGETS

#: names that stand for an unknown number: few, so that a slip of the pen does not become one
_UNKNOWN = re.compile(r"(?:c|k|tau)[1-9]?")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
_MOST_TERMS = 7
_MOST_UNKNOWN = 6


def from_expression(texts: Sequence[str], name: str = "own") -> Effect:
    """Make an effect from formulas.

    Parameters
    ----------
    texts : sequence of str
        Each ``target: formula``, several in one text divided by semicolons; formulas for one target are added. Names
        such as c, c1, k2, tau are unknown numbers to be estimated; without any, one factor c multiplies all. One that
        only shapes what another makes, as k in c*tanh(k*v), is positive.
    name : str, optional
        What the effect is called: small letters, digits and underscores.

    Returns
    -------
    Effect
        Of the group ``own``; it needs the channels that its formulas speak of.

    Raises
    ------
    UsageError
        ``expression_invalid``, ``effect_target``, ``symbol_out_of_place``, ``effect_not_finite``,
        ``effect_not_absent``, ``effect_name``, ``effect_no_effect``: a number in it changes nothing;
        ``effect_numbers``: it has too many.

    Examples
    --------
    >>> effect = from_expression(["yaw: r*abs(r)"])
    >>> dict(effect.terms), [p.name for p in effect.parameters]
    ({'yaw': 'c*(r*abs(r))'}, ['c'])
    """
    _require_name(name)
    terms = _terms([texts] if isinstance(texts, str) else texts)
    names = dict.fromkeys(n for text in terms.values() for n in names_in(text))
    unknown = [n for n in names if _UNKNOWN.fullmatch(n)]
    if not unknown:
        unknown, terms = ["c"], {target: f"c*({text})" for target, text in terms.items()}
    if len(unknown) > _MOST_UNKNOWN:
        raise UsageError(
            "effect_numbers",
            f"The formula has {len(unknown)} unknown numbers, {_MOST_UNKNOWN} is the most.",
            "Try it in parts: a trial determines few numbers.",
        )
    effect = Effect(
        name=name,
        title=f"your own effect {name}",
        plain=f"A term of your own on {_joined([TARGETS[target][1] for target in terms])}.",
        reference="written by the user",
        parameters=parameters_of(terms, unknown),
        terms=terms,
    )
    require_ordinary(effect)
    return effect


def from_file(text: str, where: str) -> Effect:
    """Make an effect from a file, and check it as the tests check those of the catalogue.

    Parameters
    ----------
    text : str
        Its content, YAML of the form of `kempf.schemas.effect.Effect`.
    where : str
        Its name, for the messages.

    Raises
    ------
    UsageError
        ``effect_file_invalid``: one message that names the file and the key, whatever is wrong with it.
    """
    effect = read(text, where)
    try:
        _require_name(effect.name)
        _check_formulas(effect)
        require_ordinary(effect)
    except UsageError as error:
        details = {"code": error.code, **error.details}
        raise invalid(where, error.message.rstrip("."), details, error.next_step) from error
    return effect


def _require_name(name: str) -> None:
    """Refuse what is no name of an effect."""
    if not (isinstance(name, str) and _NAME.fullmatch(name)):
        raise UsageError(
            "effect_name",
            f"An effect cannot be called {str(name)[:60]!r}.",
            "Take small letters, digits and underscores, a letter first, 40 at most: my_drag.",
        )


def _check_formulas(effect: Effect) -> None:
    """Compile every formula, so that a message names its key, and see that every parameter is used."""
    own = [state.name for state in effect.states]
    for parameter in effect.parameters:
        if parameter.name in SYMBOLS or parameter.name in FUNCTIONS:
            raise UsageError(
                "effect_parameter",
                f"parameters.{parameter.name}: {parameter.name!r} already stands for something else in a formula.",
                "Call the parameter c, k or tau, say.",
            )
    variables = {name: i for i, name in enumerate([*symbols_beside(own), *(p.name for p in effect.parameters)])}
    # the first parameter is the size of a rudder course
    used = {effect.parameters[0].name} if effect.rudder_course else set()
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


def _joined(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _terms(texts: Sequence[str]) -> dict[str, str]:
    parts: dict[str, list[str]] = {}
    pieces = [piece for text in texts for piece in _text(text).split(";") if piece.strip()]
    if not pieces:
        raise _no_formula("nothing is written there")
    if len(pieces) > _MOST_TERMS:
        raise _no_formula(f"it holds {len(pieces)} formulas, {_MOST_TERMS} is the most")
    for piece in pieces:
        target, colon, text = piece.partition(":")
        target = target.strip()
        if not colon:
            raise _no_formula(f"{piece.strip()[:60]!r} does not say what the formula acts on")
        if target not in TARGETS:
            close = get_close_matches(target[:60], TARGETS, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else "."
            raise UsageError(
                "effect_target",
                f"A formula acts on {target[:60]!r}, which is not known{hint}",
                f"Name one of {', '.join(TARGETS)} before the colon.",
                {"target": target[:60]},
            )
        _require_known(target, text.strip())
        parts.setdefault(target, []).append(text.strip())
    return {
        t: formulas[0] if len(formulas) == 1 else " + ".join(f"({f})" for f in formulas)
        for t, formulas in parts.items()
    }


def _require_known(target: str, text: str) -> None:
    """Compile a formula as it was written, before it is joined to others: the message points into it."""
    place = Place(target, KINDS[target], text)
    require_in_place(place)
    variables = dict.fromkeys([*allowed(place.kind), *(n for n in names_in(text) if _UNKNOWN.fullmatch(n))])
    compiled(text, {name: i for i, name in enumerate(variables)})


def _text(text: str) -> str:
    if not isinstance(text, str):
        raise _no_formula(f"it is {type(text).__name__}, no text")
    return text


def _no_formula(why: str) -> UsageError:
    return UsageError(
        "expression_invalid",
        f"The formula of an effect cannot be used: {why}.",
        "Write what it acts on, a colon and a formula, as in 'yaw: r*abs(r)'; `kempf effects show --symbols` lists "
        "what may stand in it.",
    )

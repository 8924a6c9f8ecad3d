"""Words of a page for what the command line says in its own: what to do after an error, commands, names with units."""

from __future__ import annotations

import re
from collections.abc import Mapping

from markupsafe import Markup, escape

from kempf.schemas.enumeration import as_words
from kempf.workbench.numbers import number

#: What to do after an error, by its code, where a page has other means than the options of a command.
_NEXT_STEPS: Mapping[str, str] = {
    "no_vessel_named": "Fill in the vessel, or send a profile that names her.",
    "no_vessel": "Correct the name, or choose a vessel on the fleet's page; if she is new here, say so or send her "
    "profile when you take her logs in.",
    "angles_out_of_range": "Give heading and rudder in degrees, such as 10/10.",
    "rudder_out_of_range": "Give its magnitude in degrees; to which side it goes is a field of its own.",
    "speed_out_of_range": "Give the speed through the water in m/s, or leave the field blank.",
    "speed_unknown": "Give the speed through the water.",
    "no_reason": "Say why, for those who come after.",
    "nothing_fitted": "Choose another set on the vessel's page, or bring her up to date there.",
    "stretch_over_several": "Take a stretch of one of them.",
    "prediction_diverges": "Choose another set on the vessel's page, or identify her from more manoeuvres.",
    "nothing_to_compare": "Choose another horizon, or another set on the vessel's page.",
    "effect_worsens": "A diagnosis, on the vessel's page, finds what her model lacks.",
    "horizon_unknown": "Choose one of those on the model's page.",
    "rudder_rate_out_of_range": "Give the rate at which the gear puts the rudder over.",
    "alias_ambiguous": "Give the id of the set, which her vessel's page shows.",
    "no_parameter": "Choose one of these.",
    "no_subject": "Write the note on the page of what it is about.",
    "subject_of_another_vessel": "Write the note on the page of what it is about.",
    "vessel_name": "Give a name, in the field or in the profile.",
    "log_of_another_vessel": "Send it as hers if it is; else look which of the two files was copied wrongly.",
    "no_warehouse": "Take logs in, or ask who keeps the warehouse.",
}
_LEAST_PROBABILITY = 1e-16
_UNITS = ("m_s", "deg_s", "per_m", "kg", "m", "deg", "s")
_UNIT_WORDS = {"m_s": "m/s", "deg_s": "deg/s", "per_m": "1/m"}
_ESTIMATORS = {
    "ml": "maximum likelihood",
    "ml-pooled": "maximum likelihood, manoeuvres pooled",
    "paper": "the paper's filters",
}
_ALIASES = {"withdrawn": "withdrawn (current until it was superseded)"}


def message(error: object) -> str:
    """Return what went wrong; an option of a command that the sentence begins with is named in words.

    Examples
    --------
    >>> message({"message": "--horizon '2x' is none."})
    "The horizon '2x' is none."
    """
    said = error["message"] if isinstance(error, Mapping) else str(getattr(error, "message", error))
    return re.sub(r"^--([a-z]+)", r"The \1", said)


def next_step(error: object) -> Markup:
    """Return what to do after an error, as a page says it.

    Parameters
    ----------
    error : KempfError, or mapping
        With ``code`` and ``next_step``.

    Examples
    --------
    >>> next_step({"code": "no_reason", "next_step": "Say why with --reason."})
    Markup('Say why, for those who come after.')
    """
    code, said = (
        (error["code"], error["next_step"])
        if isinstance(error, Mapping)
        else (getattr(error, "code", ""), getattr(error, "next_step", ""))
    )
    return with_commands(_NEXT_STEPS.get(code, said))


def with_commands(sentence: str) -> Markup:
    """Return a sentence with the commands in it as code.

    Examples
    --------
    >>> with_commands("See `kempf ladder` < 2.")
    Markup('See <code>kempf ladder</code> &lt; 2.')
    """
    parts = re.split(r"`([^`]*)`", sentence)
    marked = (Markup("<code>{}</code>").format(part) if k % 2 else escape(part) for k, part in enumerate(parts))
    return Markup("").join(marked)


def without_command(note: str) -> str:
    """Return a remark without the command that comes next: a page has a button for it.

    Examples
    --------
    >>> without_command("late: 1 log read by another version of kempf; next: kempf reprocess --vessel late")
    'late: 1 log read by another version of kempf.'
    """
    return note.partition("; next: ")[0].rstrip(".") + "."


def with_unit(key: str) -> str:
    """Return a key of a profile in words, its unit behind a comma.

    Examples
    --------
    >>> with_unit("trial_speed_m_s"), with_unit("wind_arm_per_m"), with_unit("block_coefficient")
    ('trial speed, m/s', 'wind arm, 1/m', 'block coefficient')
    """
    for unit in _UNITS:
        if key.endswith(f"_{unit}"):
            return f"{as_words(key.removesuffix(f'_{unit}'))}, {_UNIT_WORDS.get(unit, unit)}"
    return as_words(key)


def probability(value: float) -> str:
    """Return a probability; of one that is nothing to a computer's precision only that.

    Examples
    --------
    >>> probability(0.0), probability(5.3e-205), probability(0.0123)
    ('< 1e-16', '< 1e-16', '0.012')
    """
    return f"< {_LEAST_PROBABILITY:.0e}" if value < _LEAST_PROBABILITY else number(value, 2)


def estimator(name: str) -> str:
    """Return an estimator in words.

    Examples
    --------
    >>> estimator("ml-pooled"), estimator("output-error")
    ('maximum likelihood, manoeuvres pooled', 'output error')
    """
    return _ESTIMATORS.get(name, name.replace("-", " "))


def alias(name: str) -> str:
    """Return the name of a parameter set in words, where it is one of ours.

    Examples
    --------
    >>> alias("current"), alias("withdrawn")
    ('current', 'withdrawn (current until it was superseded)')
    """
    return _ALIASES.get(name, name)

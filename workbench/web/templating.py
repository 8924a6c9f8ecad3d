"""Templates: everything that comes from data is shown as text."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from kempf.schemas.enumeration import as_words, at_the_beginning
from kempf.schemas.instants import minute, second
from kempf.workbench.documents.tried import refits
from kempf.workbench.effect_verdicts import effect_verdict
from kempf.workbench.numbers import number, percent
from kempf.workbench.rungs import in_words, sized
from kempf.workbench.web import wording
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.pages.corrections import as_asked, undoing


def rendered(template: str, **content: Any) -> str:
    """Return a page as HTML; a name that is not given is an error."""
    return _templates().get_template(template).render(**content)


@cache
def _templates() -> Environment:
    environment = Environment(
        loader=PackageLoader("kempf.workbench.web", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters: dict[str, Callable[..., Any]] = {
        "number": number,
        "minute": minute,
        "second": second,
        "words": as_words,
        "error": in_words,
        "sized": sized,
        "probability": wording.probability,
        "percent": percent,
        "vessel_address": of_vessel,
        "as_asked": as_asked,
        "undoing": undoing,
        "refits": refits,
        "effect_verdict": effect_verdict,
        "message": wording.message,
        "next_step": wording.next_step,
        "with_commands": wording.with_commands,
        "without_command": wording.without_command,
        "with_unit": wording.with_unit,
        "estimator": wording.estimator,
        "alias": wording.alias,
        "beginning": at_the_beginning,
    }
    environment.filters |= filters
    return environment

"""The page: a report as one HTML file, in the order in which a naval architect reads."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from functools import cache
from hashlib import sha256

from jinja2 import ChoiceLoader, Environment, PackageLoader, PrefixLoader, StrictUndefined
from markupsafe import Markup

from kempf.schemas.enumeration import as_words
from kempf.workbench.report import sections
from kempf.workbench.report.content import Block, ReportContent
from kempf.workbench.static_files import contents

#: what fills a section, by its anchor; `ReportWording.sections` has the order and the titles
_BLOCKS: dict[str, Callable[[ReportContent], list[Block]]] = {
    "effects": sections.effects,
    "parameters": sections.parameters,
    "ladder": sections.ladder,
    "prediction": sections.prediction,
    "innovations": sections.innovations,
    "where": sections.where,
    "correlations": sections.correlations,
    "added": sections.added_variables,
    "confusion": sections.confusion,
    "force": sections.unmodelled,
    "coverage": sections.coverage,
    "zigzags": sections.zigzags,
    "provenance": sections.provenance,
}


def page(content: ReportContent) -> str:
    """Return the report as one HTML document that asks for nothing outside itself.

    Equal content gives equal bytes.
    """
    filled = [(name, words, _BLOCKS[name](content)) for name, words in content.wording.sections.items()]
    shown = [entry for entry in filled if entry[2]]
    script, digest = _script()
    return (
        _templates()
        .get_template("report.html")
        .render(
            content=content, wording=content.wording, sections=shown, sheets=_sheets(), script=script, digest=digest
        )
    )


@cache
def _sheets() -> Markup:
    """Return the styles of the pages and their charts."""
    return Markup("\n").join(Markup(_static(name)) for name in ("style.css", "vendor/uPlot.css"))  # noqa: S704 - ours


@cache
def _script() -> tuple[Markup, str]:
    """Return the script of the pages' charts, and its digest: a browser runs this one and no other."""
    text = "\n".join(_static(name) for name in ("vendor/uPlot.js", "chart.js"))
    return Markup(text), b64encode(sha256(text.encode()).digest()).decode("ascii")  # noqa: S704 - ours


def _static(name: str) -> str:
    return contents()[name][0].decode()


@cache
def _templates() -> Environment:
    environment = Environment(
        loader=ChoiceLoader(
            [
                PackageLoader("kempf.workbench.report", "templates"),
                PrefixLoader({"web": PackageLoader("kempf.workbench.web", "templates")}),
            ]
        ),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda content: b64encode(content).decode("ascii")
    environment.filters["data_uri"] = lambda svg: f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}"
    environment.filters["words"] = as_words
    return environment

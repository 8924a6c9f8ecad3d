"""The page: a report as one HTML file, in the order in which a naval architect reads."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from kempf.workbench.report import sections
from kempf.workbench.report.content import Block, ReportContent

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
    return _templates().get_template("report.html").render(content=content, wording=content.wording, sections=shown)


@cache
def _templates() -> Environment:
    made = Environment(
        loader=PackageLoader("kempf.workbench.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["data_uri"] = lambda svg: f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}"
    return made

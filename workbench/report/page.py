"""The page: a report as one HTML file, in the order in which a naval architect reads."""

from __future__ import annotations

from collections.abc import Callable

from kempf.workbench.report import sections
from kempf.workbench.report.content import ReportContent
from kempf.workbench.report.markup import STYLE, escape, listed, section

_SECTIONS: tuple[tuple[str, str, Callable[[ReportContent], str]], ...] = (
    ("effects", "Which effects are missing", sections.effects),
    ("ladder", "What adding them brings", sections.ladder),
    ("prediction", "Measured over predicted", sections.prediction),
    ("innovations", "Where it fails in time", sections.innovations),
    ("where", "Where it fails by phase, side and manoeuvre", sections.where),
    ("correlations", "What the innovations still know", sections.correlations),
    ("added", "The evidence, point by point", sections.added_variables),
    ("confusion", "What looks alike", sections.confusion),
    ("force", "The missing force and moment", sections.missing_force),
    ("coverage", "Where the manoeuvres have been", sections.coverage),
    ("zigzags", "Zigzags and the IMO criteria", sections.zigzags),
    ("provenance", "What this report rests on", sections.provenance),
)


def page(content: ReportContent) -> str:
    """Return the report as one HTML document that asks for nothing outside itself.

    Equal content gives equal bytes.

    Parameters
    ----------
    content : ReportContent

    Returns
    -------
    str
    """
    title = f"{content.vessel}: what her manoeuvring model lacks"
    made = [(name, words, draw(content)) for name, words, draw in _SECTIONS]
    kept = [(name, words, text) for name, words, text in made if text]
    links = "".join(f'<a href="#{name}">{escape(words)}</a>' for name, words, _ in kept)
    ship = ", ".join(f"{name} {value}" for name, value in content.ship.items())
    body = "".join(section(*one) for one in kept)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # whatever a browser or a mail program makes of it, it loads nothing
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        "style-src 'unsafe-inline'\">\n"
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<header>\n"
        f"<h1>{escape(title)}</h1>\n<p>{escape(ship)}</p>\n"
        f'<p class="headline">{escape(content.headline)}</p>\n'
        f"{listed(content.sentences)}<h3>What to do next</h3>\n{listed(content.next_steps, ordered=True)}"
        f'<nav aria-label="Contents">{links}</nav>\n</header>\n<main>\n{body}</main>\n</body>\n</html>\n'
    )

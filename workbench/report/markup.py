"""Pieces of the page: text made safe, tables, figures as part of the page, badges. No script, no outside request."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape

__all__ = ["Markup", "badge", "escape", "figure", "listed", "section", "table"]

STYLE = """
:root{color-scheme:light}
*{box-sizing:border-box}
body{font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Liberation Sans",sans-serif;color:#111;background:#fff;
max-width:60rem;margin:0 auto;padding:1.5rem 1rem 4rem}
h1{font-size:1.7rem;line-height:1.2;margin:.2rem 0 1rem}
h2{font-size:1.25rem;margin:2.6rem 0 .6rem;border-bottom:1px solid #bbb;padding-bottom:.2rem}
h3{font-size:1.05rem;margin:1.8rem 0 .4rem}
p,li{max-width:46rem}
.headline{font-size:1.2rem;font-weight:600;border-left:.4rem solid #0072b2;padding:.4rem .9rem;background:#eef5fa}
figure{margin:1rem 0;break-inside:avoid}
figure img{width:100%;height:auto;display:block}
figcaption{font-size:.9rem;color:#333;max-width:46rem}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.86rem;margin:.8rem 0}
caption{text-align:left;font-weight:600;padding:.2rem 0}
th,td{border-bottom:1px solid #ccc;padding:.25rem .7rem .25rem 0;text-align:left;vertical-align:top}
thead th{border-bottom:2px solid #444;vertical-align:bottom}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.badge{font-size:.8rem;font-weight:600;padding:.05rem .5rem;border-radius:.3rem;border:1.5px solid;white-space:nowrap}
.fitted{color:#7a3500;background:#fdf0e6;border-color:#d55e00}
.held{color:#003f63;background:#e6f1f8;border-color:#0072b2;border-style:double;border-width:3px}
nav a{margin-right:1rem;white-space:nowrap}
a{color:#00507d}
code{font-family:ui-monospace,"DejaVu Sans Mono",monospace;font-size:.92em;overflow-wrap:anywhere}
@page{size:A4;margin:15mm}
@media print{body{font-size:10.5pt;max-width:none;padding:0}nav{display:none}h2,h3{break-after:avoid}
tr{break-inside:avoid}.scroll{overflow:visible}table{font-size:8.5pt}.headline,.badge{print-color-adjust:exact;
-webkit-print-color-adjust:exact}}
"""


class Markup(str):
    """Text that is markup already; any other text is made safe."""

    __slots__ = ()


def figure(svg: bytes, alt: str, caption: str = "") -> str:
    """Return a figure that is part of the page.

    Parameters
    ----------
    svg : bytes
    alt : str
        What it shows, for those who do not see it.
    caption : str, optional
        Below it.
    """
    source = b64encode(svg).decode("ascii")
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure><img alt="{escape(alt)}" src="data:image/svg+xml;base64,{source}">{below}</figure>\n'


def table(head: Sequence[str], rows: Sequence[Sequence[str]], caption: str, numeric: Sequence[int] = ()) -> str:
    """Return a table.

    Parameters
    ----------
    head : sequence of str
    rows : sequence of sequence of str
        Text; only `Markup` is taken as it is.
    caption : str
    numeric : sequence of int
        Columns set to the right.
    """

    def cell(tag: str, k: int, text: str) -> str:
        kind = ' class="n"' if k in numeric else ""
        scope = ' scope="col"' if tag == "th" else ""
        return f"<{tag}{scope}{kind}>{text if isinstance(text, Markup) else escape(text)}</{tag}>"

    top = "".join(cell("th", k, text) for k, text in enumerate(head))
    body = "".join(f"<tr>{''.join(cell('td', k, text) for k, text in enumerate(row))}</tr>\n" for row in rows)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption><thead><tr>{top}</tr></thead>'
        f"<tbody>\n{body}</tbody></table></div>\n"
    )


def badge(*, held_out: bool) -> Markup:
    """Return the badge that says whether a manoeuvre was fitted or held out."""
    kind, words = ("held", "held out") if held_out else ("fitted", "fitted")
    return Markup(f'<span class="badge {kind}">{words}</span>')


def listed(items: Sequence[str], *, ordered: bool = False) -> str:
    """Return a list of texts."""
    tag = "ol" if ordered else "ul"
    return f"<{tag}>{''.join(f'<li>{escape(item)}</li>' for item in items)}</{tag}>\n"


def section(name: str, title: str, content: str) -> str:
    """Return a section that the contents link to.

    Parameters
    ----------
    name : str
        Its anchor.
    title, content : str
        The content is markup already.
    """
    heading = f'<h2 id="{name}-title">{escape(title)}</h2>'
    return f'<section id="{name}" aria-labelledby="{name}-title">{heading}\n{content}</section>\n'

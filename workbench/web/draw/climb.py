"""How a fit goes: log-likelihood and error one step ahead, iteration by iteration.

``static/job.js`` draws the same into the same elements while the job runs.
"""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from kempf.flows.process.progress import Figures
from kempf.workbench.numbers import percent
from kempf.workbench.web.draw.svg import drawing, element

_WIDTH, _PANEL, _LEFT, _RIGHT, _GAP = 640.0, 110.0, 76.0, 10.0, 14.0
#: how many times as far as the worst quarter of the iterations is from the best a panel reaches: where a climb begins
#: far off, nothing would be seen of the rest
_REACH = 3.0


def in_words(figures: Sequence[Figures]) -> str:
    """Return where a fit stands, for who does not see the figure; nothing before it has begun.

    Examples
    --------
    >>> in_words([Figures(1, 1, 1100.0, 0.045), Figures(2, 1, 1234.52, 0.0314)])
    'Iteration 2: log-likelihood 1234.5, error one step ahead 3.14 % (4.5 % at iteration 1).'
    """
    if not figures:
        return ""
    first, last = figures[0], figures[-1]
    error = ""
    if last.error is not None:
        error = f", error one step ahead {percent(last.error)} %"
        if first is not last and first.error is not None:
            error += f" ({percent(first.error)} % at iteration {first.iteration})"
    return f"Iteration {last.iteration}: log-likelihood {last.log_likelihood:.1f}{error}."


def draw_climb(figures: Sequence[Figures]) -> Markup:
    """Return the figure; a frame to be filled where there is nothing yet.

    Parameters
    ----------
    figures : sequence of Figures
        Of the iterations to be shown.
    """
    likelihoods = [(iteration, iteration.log_likelihood) for iteration in figures]
    errors = [(iteration, 100.0 * iteration.error) for iteration in figures if iteration.error is not None]
    parts = [
        _panel("log_likelihood", "log-likelihood", 6.0, figures, likelihoods),
        _panel("error", "error one step ahead, % of the motion", 6.0 + _PANEL + _GAP, figures, errors),
    ]
    below = 2.0 * _PANEL + _GAP + 22.0
    first, last = (str(figures[k].iteration) if figures else "" for k in (0, -1))
    parts += [
        element("text", first, x=_LEFT, y=below, class_="label first"),
        element("text", "iteration", x=(_LEFT + _WIDTH) / 2.0, y=below, text_anchor="middle", class_="label"),
        element("text", last, x=_WIDTH - _RIGHT, y=below, text_anchor="end", class_="label last"),
    ]
    title = "Log-likelihood and error one step ahead, iteration by iteration; a dot where a model is fitted"
    return drawing(_WIDTH, below + 6.0, title, *parts)


def _panel(
    kind: str, words: str, top: float, shown: Sequence[Figures], points: Sequence[tuple[Figures, float]]
) -> Markup:
    low, high = _ends([value for _, value in points], rises=kind == "log_likelihood")
    first, last = (shown[0].iteration, shown[-1].iteration) if shown else (0, 0)
    width = _WIDTH - _LEFT - _RIGHT
    line, dots, climb = "", "", 0
    for figures, value in points:
        x = _LEFT + width * (figures.iteration - first) / max(last - first, 1)
        y = top + _PANEL * (high - min(max(value, low), high)) / (high - low)
        if figures.fitted:
            dots += f"M{x:.1f} {y:.1f}h.01"
        else:
            line += f"L{x:.1f} {y:.1f}" if figures.climb == climb else f"M{x:.1f} {y:.1f}h.01"
        climb = figures.climb
    form = ".1f" if kind == "log_likelihood" else ".3g"
    labels = [format(high, form), format(low, form)] if points else ["", ""]
    return element(
        "g",
        element("rect", x=_LEFT, y=top, width=width, height=_PANEL, fill="none", class_="frame"),
        element("text", labels[0], x=_LEFT - 6.0, y=top + 11.0, text_anchor="end", class_="label high"),
        element("text", labels[1], x=_LEFT - 6.0, y=top + _PANEL, text_anchor="end", class_="label low"),
        element("text", words, x=_LEFT + 8.0, y=top + 14.0, class_="label strong"),
        element("path", d=line, fill="none", class_="line-climb"),
        element("path", d=dots, fill="none", class_="line-fitted"),
        data_kind=kind,
    )


def _ends(values: Sequence[float], *, rises: bool) -> tuple[float, float]:
    """Return between which values a panel shows them; what is farther off is on its edge."""
    if not values:
        return 0.0, 1.0
    ordered = sorted(values)
    low, high = ordered[0], ordered[-1]
    quarter = ordered[len(ordered) // 4] if rises else ordered[-1 - len(ordered) // 4]
    if rises and quarter < high:
        low = max(low, high - _REACH * (high - quarter))
    if not rises and quarter > low:
        high = min(high, low + _REACH * (quarter - low))
    room = 0.06 * (high - low) or 0.5
    return low - room, high + room

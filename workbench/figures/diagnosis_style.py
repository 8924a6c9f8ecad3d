"""How the figures of a diagnosis look: colours that everybody can tell apart, one size of letter, bytes that repeat.

Colours are those of Okabe and Ito (2008), "Color universal design"; what a colour says, a line style or a marker says
too, so that a print in grey loses nothing. In an SVG each named colour is a variable with a second value for a dark
page; what is rasterized keeps the first, so nothing that is drawn in ink may be.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any, Literal

import numpy as np

from kempf.pipeline.channels.series import Float

#: letters, axes and measurements; lines behind them; a band that belongs to the background
INK, FAINT, BAND = "#0b0c0e", "#8b8c8e", "#dbdcde"
#: the first model, the last, and what a criterion allows
PLAIN, FULL, LIMIT = "#d55e00", "#0072b2", "#cc79a7"
#: one after the other, for sets of effects
SET_COLOURS = (FULL, "#e69f00", "#009e73", LIMIT, "#56b4e9", PLAIN)
#: tints behind a curve by phase of the manoeuvre
PHASE_COLOURS = {
    "execute": "#f6c7a8",
    "yaw_build_up": "#fbefb0",
    "overshoot": "#e9c7dc",
    "counter_rudder": "#bfe3f5",
    "steady_yaw": "#bfe5d8",
}
#: colours on a dark page
_DARK = {
    INK: "#e8e9eb",
    FAINT: "#8b8c8e",
    BAND: "#3a3d42",
    PLAIN: "#f0883e",
    FULL: "#58b0e8",
    LIMIT: "#e29cc3",
    "#f6c7a8": "#5c3621",
    "#fbefb0": "#4f471b",
    "#e9c7dc": "#512f45",
    "#bfe3f5": "#1f4557",
    "#bfe5d8": "#1f4a3e",
}
PHASE_WORDS = {
    "execute": "execute",
    "yaw_build_up": "yaw build-up",
    "overshoot": "overshoot",
    "counter_rudder": "counter-rudder",
    "steady_yaw": "steady yaw",
}
#: lateral speed, yaw rate, heading: words, unit people use, factor to it
CHANNELS = (
    ("lateral speed", "m/s", 1.0),
    ("yaw rate", "deg/s", 57.29577951308232),
    ("heading", "deg", 57.29577951308232),
)
WIDTH_IN = 8.2
_STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "legend.fontsize": 8.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.linewidth": 0.3,
    "grid.color": FAINT,
    "grid.alpha": 0.35,
    **dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), INK),
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "svg.hashsalt": "kempf",
    "svg.fonttype": "path",
    "path.simplify_threshold": 0.3,
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the style of the report, whatever a person's own settings are."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        for name, value in _STYLE.items():
            mpl.rcParams[name] = value  # type: ignore[index]
        yield


def new_figure(height_in: float) -> Any:
    """Return an empty figure that no global state knows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def framed_figure(height_in: float, legend_in: float) -> Any:
    """Return an empty figure whose margins are fixed; laying one out by its labels costs as much as drawing it.

    Parameters
    ----------
    height_in, legend_in : float
        Height, and how much of it the legend above the panels takes, inch.
    """
    figure = new_figure(height_in)
    figure.set_layout_engine(None)
    figure.subplots_adjust(
        left=0.85 / WIDTH_IN,
        right=1.0 - 0.15 / WIDTH_IN,
        bottom=0.5 / height_in,
        top=1.0 - (0.3 + legend_in) / height_in,
        hspace=0.45,
    )
    return figure


def draw_dots(panel: Any, x: Float, y: Float) -> None:
    """Draw measurements as dots in ink, all in one path: a symbol for each would be ten times as long a text.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        NaN where there is none.
    """
    known = np.isfinite(y)
    # strokes so short that their round ends make a dot
    x_pairs = np.column_stack([x[known], x[known] + 1e-3, np.full(known.sum(), np.nan)])
    y_pairs = np.column_stack([y[known], y[known], np.full(known.sum(), np.nan)])
    panel.plot(x_pairs.ravel(), y_pairs.ravel(), color=INK, lw=1.7, solid_capstyle="round")
    panel.plot([], [], ".", ms=4, mec="none", color=INK, label="measured")


def bytes_of(figure: Any, form: Literal["svg", "png"] = "svg") -> bytes:
    """Return a figure as the bytes of an SVG or PNG file; equal figures give equal bytes.

    Parameters
    ----------
    form : {"svg", "png"}, optional
    """
    stream = BytesIO()
    metadata = {"Date": None, "Creator": None} if form == "svg" else {"Software": None}
    with style():
        engine = figure.get_layout_engine()
        if engine is not None:
            # laid out once: each further time would move it a little, and cost a drawing
            engine.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(stream, format=form, dpi=130, metadata=metadata)
    return _with_variables(stream.getvalue()) if form == "svg" else stream.getvalue()


def _with_variables(svg: bytes) -> bytes:
    """Return an SVG whose named colours follow the page, dark or light; on paper it is light."""
    names = {colour: f"--c{number}" for number, colour in enumerate(_DARK)}
    light = "".join(f"{name}:{colour};" for colour, name in names.items())
    dark = "".join(f"{names[colour]}:{shade};" for colour, shade in _DARK.items())
    for colour, name in names.items():
        svg = svg.replace(colour.encode(), f"var({name})".encode())
    sheet = f"<style>:root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}</style>"
    head, mark, rest = svg.partition(b" <defs>")
    return head + sheet.encode() + mark + rest

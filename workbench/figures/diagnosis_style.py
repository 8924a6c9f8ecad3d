"""How the figures of a diagnosis look: colours that everybody can tell apart, one size of letter, bytes that repeat.

Colours are those of Okabe and Ito (2008), "Color universal design"; what a colour says, a line style or a marker says
too, so that a print in grey loses nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any, Literal

#: measured, the plain model, the model with effects
MEASURED, PLAIN, FULL = "black", "#D55E00", "#0072B2"
#: one after the other, for sets of effects
SET_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
OTHER = "0.72"
#: tints behind a curve by phase of the manoeuvre
PHASE_COLOURS = {
    "approach": "#FFFFFF",
    "execute": "#F6C7A8",
    "yaw_build_up": "#FBEFB0",
    "overshoot": "#E9C7DC",
    "counter_rudder": "#BFE3F5",
    "steady_yaw": "#BFE5D8",
}
PHASE_WORDS = {
    "approach": "approach",
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
    "grid.color": "0.8",
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "figure.facecolor": "white",
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


def new_figure(height_in: float, width_in: float = WIDTH_IN) -> Any:
    """Return an empty figure that no global state knows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def bytes_of(figure: Any, form: Literal["svg", "png"] = "svg") -> bytes:
    """Return a figure as the bytes of an SVG or PNG file; equal figures give equal bytes.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    form : {"svg", "png"}, optional
    """
    stream = BytesIO()
    metadata = {"Date": None, "Creator": None} if form == "svg" else {"Software": None}
    with style():
        engine = figure.get_layout_engine()
        if engine is not None:
            # laid out once: each further time would move it a little, and cost a drawing
            engine.execute(figure)
            figure.set_layout_engine("none")
        figure.savefig(stream, format=form, dpi=130, metadata=metadata)
    return stream.getvalue()

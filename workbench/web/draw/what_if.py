"""A manoeuvre run freely with several values of one parameter; of these one is shown at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from kempf.pipeline.channels.series import Float
from kempf.workbench.web.draw.run import draw_panels


def draw_what_if(series: Mapping[str, Any]) -> Markup:
    """Return the figure.

    Parameters
    ----------
    series : mapping
        See `kempf.flows.jobs.compare.what_if.series_of`.
    """
    measured = _columns(series["measured"])
    time = measured.pop("time_s")
    tried = [_columns(prediction) for prediction in series["predicted"]]
    return draw_panels(
        time,
        measured,
        [(prediction, f"try try-{k}") for k, prediction in enumerate(tried)],
        "Measured (dots) and run freely with each value of the parameter (lines)",
    )


def _columns(series: Mapping[str, Sequence[float | None]]) -> dict[str, Float]:
    return {name: np.array([np.nan if x is None else x for x in values]) for name, values in series.items()}

"""The series of a log that a chart asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.schemas.channels import CHANNELS
from kempf.schemas.errors import NotFound, UsageError
from kempf.schemas.motion_channel import MOTION
from kempf.warehouse.tables import logs, segments
from kempf.workbench.charts.bins import Shown, reduced
from kempf.workbench.charts.channels import LATERAL, entry
from kempf.workbench.charts.frames import encoded
from kempf.workbench.charts.turns import within_a_turn
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.data.predictions import kept_of
from kempf.workbench.web.window import window

#: stretches that a chart may tell apart, channels that an answer may have
MOST_BINS, MOST_CHANNELS = 1500, 12
#: those that a page begins with, as far as the log has them
FIRST = ("rudder_angle", "rudder_order", "heading", "yaw_rate", "speed_through_water", "speed_over_ground")
#: in a track and not in a chart
_PLACES = ("latitude", "longitude")


def frame(
    app_state: AppState, log_id: str, channels: str, asked_from: str | None, asked_to: str | None, bins: int
) -> bytes:
    """Return channels of a log over a window; see `kempf.workbench.charts.frames`.

    Parameters
    ----------
    log_id : str
        Or the beginning of one.
    channels : str
        Names, separated by commas.
    asked_from, asked_to : str or None
        Ends of the window; None for those of the log.

    Raises
    ------
    NotFound
        ``no_log``.
    UsageError
        ``channel_unknown``, ``too_many_channels``, ``instant_unreadable``, ``window_empty``.
    """
    row = logs.by_prefix(app_state.warehouse, log_id)
    begin, end = window(asked_from, asked_to, row.start_utc_ns, row.end_utc_ns)
    instruments = app_state.channels.of(row.ingest_id)
    names = list(dict.fromkeys(channels.split(",")))
    if len(names) > MOST_CHANNELS:
        raise UsageError(
            "too_many_channels", f"{len(names)} channels at once; at most {MOST_CHANNELS}.", "Ask for fewer at a time."
        )
    unknown = [name for name in names if name not in instruments.series]
    if unknown:
        raise UsageError(
            "channel_unknown",
            f"The log has no channel {', '.join(unknown)[:200]}; it has {', '.join(instruments.series)}.",
            "Choose among these.",
        )
    few = max(1, min(bins, MOST_BINS))
    return encoded(
        begin, end, {name: _within(name, reduced(instruments.series[name], begin, end, few)) for name in names}
    )


def predicted_frame(app_state: AppState, segment_id: str, fields: Mapping[str, str], bins: int) -> bytes:
    """Return what a kept prediction says of a manoeuvre over a window, as ``channel:predicted``.

    With it the lateral speed as it was measured, which no log holds (eq. (18) of the paper).

    Parameters
    ----------
    fields : mapping
        ``set``, ``h`` (horizon), ``from``, ``to``.

    Raises
    ------
    NotFound
        ``no_segment``, ``no_prediction``.
    UsageError
        ``instant_unreadable``, ``window_empty``.
    """
    segment = segments.by_prefix(app_state.warehouse, segment_id)
    prediction = kept_of(
        app_state.warehouse, app_state.folder, segment.vessel, fields.get("set"), fields.get("h")
    ).prediction
    if prediction is None or segment.segment_id not in prediction.columns:
        raise NotFound("no_prediction", "This manoeuvre is not predicted.", "Predict on the model's page.")
    row = logs.of_ingest(app_state.warehouse, segment.ingest_id)
    begin, end = window(fields.get("from"), fields.get("to"), row.start_utc_ns, row.end_utc_ns)
    few, columns = max(1, min(bins, MOST_BINS)), prediction.series(segment.segment_id)
    names = {LATERAL: f"{LATERAL}_{MOTION[LATERAL].suffix}"}
    names |= {f"{name}:predicted": f"{name}_predicted_{channel.suffix}" for name, channel in MOTION.items()}
    shown = {}
    for name, column in names.items():
        known = np.isfinite(columns[column])
        series = Series(columns["time_utc_ns"][known].astype(np.int64), columns[column][known])
        if len(series):
            shown[name] = reduced(series, begin, end, few)
    return encoded(begin, end, shown)


def _within(name: str, shown: Shown) -> Shown:
    circle = CHANNELS[name].wrap == "circle"
    return replace(shown, value=within_a_turn(shown.value)) if circle else shown


def offered(instruments: Instruments) -> list[dict[str, Any]]:
    """Return the channels of a log that a chart can show, those that a page begins with first."""
    names = [name for name in FIRST if name in instruments.series]
    names += [name for name in CHANNELS if name in instruments.series and name not in (*FIRST, *_PLACES)]
    return [entry(name, instruments.sources[name], shown=name in FIRST) for name in names]

"""What the channel doctor finds in a segment means for its identification: it is refused, or a warning is given.

Which channels disagree is the doctor's question (`kempf.pipeline.channels.doctor`): its checks, units and thresholds.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.doctor.corrections import setting
from kempf.pipeline.channels.doctor.examine import ChannelFinding, examine_window
from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import VELOCITIES, Log
from kempf.pipeline.channels.doctor.outcome import Outcome
from kempf.pipeline.channels.doctor.verdict import sentence
from kempf.schemas.enumeration import listed
from kempf.schemas.errors import DataRejected

_DIRECTIONS = ("heading", "course_over_ground", *VELOCITIES["earth"], *VELOCITIES["body"])
#: channels that identification compares or takes in
EXAMINED = (*_DIRECTIONS, "speed_over_ground", "speed_through_water", "yaw_rate", "rudder_angle", *VELOCITIES["track"])
#: codes of faults that make a segment useless, by kind and first channel
CODES = {
    ("unit", "heading"): "heading_unit",
    ("sign", "heading"): "heading_sign",
    ("stuck", "heading"): "heading_stuck",
    ("stuck", "speed_through_water"): "speed_stuck",
    ("leap", "heading"): "heading_leap",
    ("unit", "yaw_rate"): "yaw_rate_unit",
    ("sign", "yaw_rate"): "yaw_rate_sign",
    ("unit", "rudder_angle"): "rudder_unit",
    ("unit", "speed_over_ground"): "speed_unit",
    ("unit", "speed_through_water"): "speed_unit",
    ("sign", "speed_through_water"): "speed_negative",
}
#: a direction turned by more than this has nothing to do with the lateral speed of eq. (18), rad
FARTHEST_RAD = float(np.deg2rad(45.0))
#: a heading that leaps by more is no heading of one manoeuvre; by less it is warned of, rad
_LEAP_RAD = float(np.deg2rad(10.0))
_NEXT_STEPS = {
    "heading_stuck": "Identification needs a working heading: repair the compass or map another one, and repeat the "
    "manoeuvre; where it is stuck only for a while, identify the part before or after.",
    "heading_leap": "Identify the part before or after the leap (`kempf segments correct`), or repeat the manoeuvre.",
    "speed_stuck": "Map no speed_through_water for this log, so that her speed is estimated from the others, or "
    "identify the part before or after.",
    "course_not_along_heading": "Check unit, sign and offset of heading and course, and whether she went astern{line}.",
    "speed_negative": "Write {line} if she went ahead, or choose a segment ahead.",
}


def check_channels(window: Log) -> tuple[bool, tuple[str, ...]]:
    """Examine the channels of a segment.

    Parameters
    ----------
    window : Log
        The segment's readings of the channels `EXAMINED`.

    Returns
    -------
    usable : bool
        Whether the yaw rate can be used.
    warnings : tuple of str

    Raises
    ------
    DataRejected
        One of `CODES`, or ``course_not_along_heading``.
    """
    examination = examine_window(window)
    usable, warnings = True, []
    for finding in examination.findings:
        _refuse(finding)
        warning = f"{sentence(finding)}: {finding.evidence[0].words}"
        if any(fault.kind == "stuck" for fault in finding.faults):
            usable = False
            warning += "; the channel is left out, the yaw rate is estimated through the heading"
        warnings.append(warning)
    return usable, (*warnings, *(_doubt(outcome) for outcome in examination.outcomes if outcome.doubtful))


def _doubt(outcome: Outcome) -> str:
    return f"{listed(outcome.channels)} may disagree: {outcome.words}"


def _refuse(finding: ChannelFinding) -> None:
    for fault in finding.faults:
        code = _code(fault)
        if code is None:
            continue
        line = f"`{setting(fault)}` for {listed(fault.channels)} in the vessel profile"
        step = _NEXT_STEPS.get(code, "Write {line}; `kempf doctor` shows the whole line.")
        raise DataRejected(
            code,
            f"{sentence(finding).capitalize()}: {finding.evidence[0].words}.",
            step.format(line=f": {line}" if code == "course_not_along_heading" else line),
            {"kind": fault.kind, "channels": list(fault.channels), "value": fault.value, "std": fault.std},
        )


def _code(fault: Fault) -> str | None:
    """Return the code of a fault that makes the segment useless, None for one that is only warned of."""
    channel = fault.channels[0]
    if fault.kind == "leap" and abs(fault.value) <= _LEAP_RAD:
        return None
    if fault.kind == "offset" and fault.name.startswith("counted anticlockwise") and channel == "heading":
        return "heading_sign"
    code = CODES.get((fault.kind, channel))
    if code is not None or channel not in _DIRECTIONS:
        return code
    if fault.kind == "unit" and channel != "course_over_ground":
        return "speed_unit"
    if fault.kind in ("sign", "unit", "swap", "frame") or (fault.kind == "offset" and abs(fault.value) > FARTHEST_RAD):
        return "course_not_along_heading"
    return None

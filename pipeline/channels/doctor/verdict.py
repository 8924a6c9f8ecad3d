"""What the doctor says, in words and as JSON: findings with their evidence and the lines that correct them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import pi
from typing import Any

from kempf.pipeline.channels.doctor.corrections import propose
from kempf.pipeline.channels.doctor.examine import ChannelFinding, Examination
from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.outcome import CheckFigure, Outcome
from kempf.schemas.enumeration import listed
from kempf.schemas.profile import ChannelMap

_FRAMES = {"body-fixed": "earth-fixed components are expected", "earth-fixed": "body-fixed components are expected"}


def as_json(examination: Examination, known: Mapping[str, tuple[str, ChannelMap]], log_format: str) -> dict[str, Any]:
    """Return an examination as JSON content.

    Parameters
    ----------
    known : mapping of str to (str, ChannelMap)
        Entry of the profile behind each channel, from `kempf.pipeline.channels.doctor.corrections.entries`.
    log_format : {"delimited", "mcap", "nmea"}

    Returns
    -------
    dict
        ``verdict``, ``findings``, ``checks``, ``untested``; ``moves``: false where she does not, and motions could not
        be compared; ``cannot_see``: what could be wrong without any check showing it.
    """
    return {
        "verdict": examination.verdict,
        "findings": [_finding(finding, known, log_format) for finding in examination.findings],
        "checks": [_outcome(outcome) for outcome in examination.outcomes],
        "untested": list(examination.untested),
        "moves": not examination.still,
        "cannot_see": list(examination.cannot_see),
    }


def _finding(finding: ChannelFinding, known: Mapping[str, tuple[str, ChannelMap]], log_format: str) -> dict[str, Any]:
    faults = []
    for fault in finding.faults:
        corrections = propose(fault, known, log_format)
        faults.append(
            {
                "kind": fault.kind,
                "channels": list(fault.channels),
                "words": words(fault),
                "value": fault.value,
                "std": fault.std,
                "profile": [correction.line for correction in corrections],
                "entries": {
                    correction.key: correction.mapped.model_dump(exclude_defaults=True) for correction in corrections
                },
            }
        )
    return {
        "words": sentence(finding),
        "channels": list(finding.channels),
        "certain": len(finding.faults) == 1,
        "faults": faults,
        "evidence": [_outcome(outcome) for outcome in finding.evidence],
    }


def _outcome(outcome: Outcome) -> dict[str, Any]:
    return {
        "check": outcome.check,
        "channels": list(outcome.channels),
        "state": outcome.state,
        "words": outcome.words,
        "figures": [_figure(figure) for figure in outcome.figures],
    }


def _figure(figure: CheckFigure) -> dict[str, Any]:
    return {
        "name": figure.name,
        "value": float(figure.value),
        "std": float(figure.std),
        "expected": [float(figure.low), float(figure.high)],
        "unit": figure.unit,
    }


def sentence(finding: ChannelFinding) -> str:
    """Return a finding as one sentence."""
    if not finding.faults:
        if finding.evidence[0].claim:
            return finding.evidence[0].claim
        which = "one" if len(finding.channels) == 2 else "at least one"
        whose = f"{listed(finding.channels)} disagree; {which} of them is wrong"
        return f"{whose}, and no single correction takes the contradiction away"
    if len(finding.faults) == 1:
        return words(finding.faults[0])
    return "one of these: " + "; or ".join(words(fault) for fault in finding.faults)


def words(fault: Fault) -> str:
    """Return a fault in plain words.

    Examples
    --------
    >>> words(Fault("unit", ("speed_over_ground",), 0.514, "kn taken for m/s"))
    'speed_over_ground is in kn, taken for m/s'
    >>> words(Fault("latency", ("heading",), 2.5, "late", 0.04))
    'heading is 2.50 ± 0.04 s (1 s.e.) late'
    """
    return _WORDS[fault.kind](listed(fault.channels), fault)


def _of_offset(names: str, fault: Fault) -> str:
    if fault.name.startswith("counted"):
        return f"{names} is {fault.name.replace('counted', 'measured')}"
    return f"{names} has an offset: add {fault.value * 180.0 / pi:+.1f} ± {fault.std * 180.0 / pi:.1g} deg (1 s.e.)"


def _of_clock(names: str, fault: Fault) -> str:
    pace = "gains" if fault.value > 0 else "loses"
    return f"the clock of {names} {pace} {abs(fault.value) * 1e3:.3g} ± {fault.std * 1e3:.1g} s in 1000 s (1 s.e.)"


_WORDS: dict[str, Callable[[str, Fault], str]] = {
    "unit": lambda names, fault: (
        f"{names} {'is' if len(fault.channels) == 1 else 'are'} in {fault.name.replace(' taken', ', taken', 1)}"
    ),
    "sign": lambda names, _: f"{names} has the wrong sign",
    "swap": lambda names, _: f"{names} are swapped",
    "axes": lambda names, _: (
        f"{names} are in axes north, east and down, taken for east, north and up, or the other way round"
    ),
    "frame": lambda names, fault: f"{names} are {fault.name} where {_FRAMES[fault.name]}",
    "latency": lambda names, fault: (
        f"{names} is {abs(fault.value):.2f} ± {fault.std:.1g} s ({fault.spread}) "
        f"{'late' if fault.value > 0 else 'early'}"
    ),
    "scale": lambda names, fault: f"{names} has to be multiplied by {fault.value:.4g} ± {fault.std:.1g} (1 s.e.)",
    "stuck": lambda names, _: f"{names} is stuck",
    "leap": lambda names, fault: f"{names} leaps by {fault.value * 180.0 / pi:+.1f} deg",
    "offset": _of_offset,
    "clock_scale": _of_clock,
}

"""A ship that gets a larger rudder: a zigzag a month, for the page of changes in docs/workbench.md."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import yaml

from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.units import SECOND_NS

VESSEL, LARGER = "refitted", 1.12
#: zigzags, and how many of them before she is docked
_ZIGZAGS, _BEFORE = 10, 6
_MONTH_NS = 30 * 86_400 * SECOND_NS


def write(folder: Path) -> int:
    """Write a log a zigzag and ``refitted.yaml`` into a folder.

    Returns
    -------
    int
        When she was docked, UTC nanoseconds.
    """
    folder.mkdir(parents=True, exist_ok=True)
    first = zigzag_settings("ferry", duration_s=900.0)
    larger = replace(first.hull.parameters, b1=LARGER * first.hull.parameters.b1, b2=LARGER * first.hull.parameters.b2)
    for k in range(_ZIGZAGS):
        hull = first.hull if k < _BEFORE else replace(first.hull, parameters=larger)
        start_ns = first.start_utc_ns + k * _MONTH_NS
        trial = simulate_trial(replace(first, hull=hull, seed=k, start_utc_ns=start_ns))
        (folder / f"zigzag_{k + 1:02}.mcap").write_bytes(to_mcap(trial))
    profile = logger_profile(first).model_copy(update={"vessel": VESSEL})
    text = yaml.safe_dump(profile.model_dump(mode="json", exclude_defaults=True), sort_keys=False)
    (folder / f"{VESSEL}.yaml").write_text(text, encoding="utf-8")
    return first.start_utc_ns + _BEFORE * _MONTH_NS - _MONTH_NS // 2

"""What it costs to take an earth-fixed current for the paper's V_T: ``python -m benchmarks.identify.current_frame``.

A 20-minute 20/20 zigzag in a stream of 0.3 m/s that is fixed over ground, from raw log bytes to the estimates: once
with the current as two states fixed in the earth frame, once with the single state V_T of eq. (16), which takes the
lateral part of the current for constant while the heading swings. Printed are the errors in standard errors.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from tests.reading import read_log

MODES = ("earth", "lateral")
RESULTS = Path(__file__).parents[1] / "results" / "current_frame.md"


@dataclass(frozen=True)
class Errors:
    """Errors of one run in standard errors, shape (6,), and whether the search converged."""

    seed: int
    current: str
    z: np.ndarray
    converged: bool


def run(seed: int) -> list[Errors]:
    """Sail, log, read, find the zigzag, fit it with both models of the current."""
    settings = zigzag_settings("mariner", seed=seed)
    trial = simulate_trial(settings)
    instruments = from_readings(read_log("trial.nmea", to_nmea(trial), logger_profile(settings)).frame)
    (zigzag,) = find_zigzags(
        instruments.series["heading"],
        instruments.series["rudder_angle"],
        instruments.series["speed_through_water"],
    )
    record = make_record(instruments, zigzag.start_utc_ns, zigzag.end_utc_ns)
    truth = np.array([getattr(trial.truth.parameters, name) for name in HULL_PARAMETERS])
    found = []
    for current in MODES:
        spec = ModelSpec.model_validate({"current": current})
        fit = identify(record, spec, trial.truth.wind_arm_per_m, MaximumLikelihoodSettings())
        value, std = (np.array([getattr(p, part) for p in fit.parameters]) for part in ("value", "std"))
        found.append(Errors(seed, current, (value - truth) / std, fit.converged))
    return found


def table(runs: list[Errors]) -> list[str]:
    """Lines of the table, one a run and model, then the rms of each model over the runs."""
    names = tuple(HULL_PARAMETERS)
    lines = [
        f"| seed | current | {' | '.join(names)} | converged |",
        "|---|---|" + "---|" * (len(names) + 1),
    ]
    for one in runs:
        cells = " | ".join(f"{z:+.1f}" for z in one.z)
        lines.append(f"| {one.seed} | {one.current} | {cells} | {'yes' if one.converged else 'no'} |")
    for current in MODES:
        rms = np.sqrt(np.mean(np.square([one.z for one in runs if one.current == current]), axis=0))
        converged = sum(one.converged for one in runs if one.current == current)
        lines.append(f"| rms | {current} | {' | '.join(f'{z:.1f}' for z in rms)} | {converged} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 11)))
    seeds = parser.parse_args().seeds
    runs = [errors for seed in seeds for errors in run(seed)]
    text = "\n".join(
        (
            "# An earth-fixed stream of 0.3 m/s, modelled in the earth frame and as V_T",
            "",
            f"`python -m benchmarks.identify.current_frame --seeds {' '.join(map(str, seeds))}`: errors of the "
            "estimates in",
            "standard errors; 20-minute 20/20 zigzags of the Mariner hull from NMEA logs.",
            "",
            *table(runs),
            "",
        )
    )
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()

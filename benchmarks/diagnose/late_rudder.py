"""A ship whose rudder answers late, for the tour of docs/diagnosis.md.

``python -m benchmarks.diagnose.late_rudder DIR``.

Three zigzags of a mariner-like ship in a moderate sea, sailed by the plant of the hidden effects, which shares no code
with the estimator; a log of what her instruments showed and her profile.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import yaml

from benchmarks.diagnose.hidden_effects import programme, readings, sail
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import Trial, TrialSettings
from kempf.schemas.units import SECOND_NS

VESSEL, LAG_S = "late", 2.0
_SEED, _ZIGZAGS, _AFTER_S = 3, 3, 30.0


def write(folder: Path) -> None:
    """Write ``day.mcap`` and ``late.yaml`` into a folder.

    Parameters
    ----------
    folder : Path
        Made where it is not there.
    """
    hull = programme.ship("mariner", _SEED)
    weather = programme.weather(hull, "moderate", _SEED, 0)
    voyage = sail.voyage(hull, weather, CATALOGUE["rudder_lag"], LAG_S, _SEED, 0)
    settings = TrialSettings(hull, (), instruments=readings.instruments(hull), seed=_SEED)
    trial = readings.read(hull, voyage, weather.wind_from_rad, settings, None)
    profile = logger_profile(settings).model_copy(update={"vessel": VESSEL})
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "day.mcap").write_bytes(to_mcap(_until(trial, voyage.executes_s[_ZIGZAGS - 1][-1] + _AFTER_S)))
    text = yaml.safe_dump(profile.model_dump(mode="json", exclude_defaults=True), sort_keys=False)
    (folder / "late.yaml").write_text(text, encoding="utf-8")


def _until(trial: Trial, end_s: float) -> Trial:
    end, records = trial.settings.start_utc_ns + round(end_s * SECOND_NS), []
    for one in trial.instruments:
        n = int(one.measured_utc_ns.searchsorted(end))
        values = {name: column[:n] for name, column in one.values.items()}
        measured, arrival = one.measured_utc_ns[:n], one.arrival_utc_ns[:n]
        records.append(replace(one, measured_utc_ns=measured, arrival_utc_ns=arrival, values=values))
    return replace(trial, instruments=tuple(records))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    write(parser.parse_args(arguments).folder)


if __name__ == "__main__":
    main()

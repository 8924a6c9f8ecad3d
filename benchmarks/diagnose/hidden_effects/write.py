"""Write the hidden cases and seal the answers: ``python -m benchmarks.diagnose.hidden_effects.write --out DIR``.

``DIR/cases/<id>/`` gets two raw logs and ``profile.yaml``, ``DIR/sealed.bin`` the answers; the key lies outside DIR. A
case that is already there is not written again, so an interrupted run goes on where it was.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import secrets
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.diagnose.hidden_effects import plant, programme, readings, sail
from benchmarks.diagnose.hidden_effects.cases import Case, design
from benchmarks.diagnose.hidden_effects.effects import theta
from benchmarks.diagnose.hidden_effects.seal import seal
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.pipeline.simulate.random_streams import stream
from kempf.pipeline.simulate.trial import Trial, TrialSettings

_CASES = 336


def _csv(trial: Trial, case: Case) -> bytes:
    # every reading stands in two rows at least, by which a reader sees when it was new
    fastest = max(record.instrument.rate_hz for record in trial.instruments)
    return to_csv(trial, case.rows_hz or max(10.0, 2.0 * fastest))


_TO: dict[str, tuple[str, Callable[[Trial, Case], bytes]]] = {
    "csv": ("csv.gz", _csv),
    "mcap": ("mcap", lambda trial, _: to_mcap(trial)),
    "nmea": ("nmea.gz", lambda trial, _: to_nmea(trial)),
}


def logs_of(case: Case) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Return the files of a case by name, and its answer as JSON content.

    Raises
    ------
    VoyageFailed
        She cannot sail it.
    """
    hull = programme.ship(case.hull, case.seed)
    weathers = tuple(programme.weather(hull, case.disturbance, case.seed, day) for day in range(programme.DAYS))
    effect = case.hidden
    c, voyages = sail.voyages(hull, weathers, effect, case.strength, case.seed)
    files: dict[str, bytes] = {}
    for day, (weather, voyage) in enumerate(zip(weathers, voyages, strict=True)):
        settings = _settings(case, hull, day)
        sensor = (effect.name, c) if effect and effect.sensor else None
        trial = readings.read(hull, voyage, weather.wind_from_rad, settings, sensor, sold=case.sold)
        ending, write = _TO[case.formats[day]]
        begin = datetime.fromtimestamp(settings.start_utc_ns // 1_000_000_000, UTC)
        files[f"{begin:%Y%m%dT%H%M}.{ending}"] = write(trial, case)
    profile = logger_profile(_settings(case, hull, 0)).model_copy(update={"vessel": case.case_id})
    text = yaml.safe_dump(profile.model_dump(mode="json", exclude_defaults=True), sort_keys=False)
    files["profile.yaml"] = text.encode()
    return files, _answer(case, hull, c, voyages, weathers)


def _settings(case: Case, hull: SimulatedHull, day: int) -> TrialSettings:
    random = stream(case.seed, "place and date")
    latitude, longitude, days, apart = (random.uniform(*b) for b in ((35, 62), (-30, 30), (0, 300), (20, 120)))
    begin = datetime(2025, 1, 5, 6, tzinfo=UTC) + timedelta(days=int(days) + day * int(apart))
    begin += timedelta(minutes=int(random.integers(0, 240)), seconds=int(random.integers(0, 60)))
    return TrialSettings(
        hull,
        (),
        instruments=readings.instruments(hull),
        seed=case.seed * programme.DAYS + day,
        noise_scale=case.noise,
        start_utc_ns=int(begin.timestamp()) * 1_000_000_000,
        latitude_deg=float(latitude),
        longitude_deg=float(longitude),
    )


def _answer(
    case: Case,
    hull: SimulatedHull,
    c: float,
    voyages: tuple[sail.Voyage, ...],
    weathers: tuple[programme.Weather, ...],
) -> dict[str, Any]:
    effect = case.hidden
    strengths = theta(effect, c, hull)
    moves = effect is not None and not effect.sensor and not effect.sizes
    return {
        **asdict(case),
        "parameters": effect.parameters(c) if effect else {},
        "unit": effect.unit if effect else "",
        "equation": effect.equation if effect else "",
        "share_of_rudder": sail.added(voyages, hull, weathers, strengths) if moves else None,
        "theta": {str(k): float(strengths[k]) for k in np.flatnonzero(strengths)},
        "hull_parameters": asdict(hull.parameters),
        "wind_arm_per_m": hull.wind_arm_per_m,
        "executes_utc_ns": [
            [[_settings(case, hull, day).start_utc_ns + round(t * 1e9) for t in run] for run in voyage.executes_s]
            for day, voyage in enumerate(voyages)
        ],
        "runs": [
            [[float(x) for x in row[[plant.PSI0_, plant.DELTA0_, plant.SIDE_, plant.LEGS_]]] for row in orders]
            for orders in (_zigzags(hull, case.seed, day) for day in range(programme.DAYS))
        ],
    }


def _zigzags(hull: SimulatedHull, seed: int, day: int) -> np.ndarray:
    orders = programme.orders(hull, seed, day)
    return orders[orders[:, plant.KIND_] == 1.0]


def write_case(case: Case, folder: Path, answers: Path) -> None:
    """Write one case; its answer goes to another folder, a crash leaves no half a case.

    Parameters
    ----------
    folder : Path
        Of all cases.
    answers : Path
        Folder of the answers that are not sealed yet; outside the cases' folder.
    """
    own = answers / f"{case.case_id}.json"
    if own.exists() and (folder / case.case_id).exists():
        return
    files, answer = logs_of(case)
    part = answers / f"{case.case_id}.part"
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    for name, data in files.items():
        (part / name).write_bytes(data)
    answer["files"] = {name: hashlib.sha256(data).hexdigest() for name, data in sorted(files.items())}
    folder.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(folder / case.case_id, ignore_errors=True)
    part.rename(folder / case.case_id)
    own.write_text(json.dumps(answer), encoding="utf-8")


def write_all(
    out: Path,
    key_file: Path,
    n: int,
    seed: int,
    rows_hz: float | None = None,
    show: Callable[[str], None] = print,
) -> str:
    """Write all cases, seal the answers and return the SHA-256 of the sealed file.

    Parameters
    ----------
    out : Path
        Gets ``cases/`` and ``sealed.bin``.
    key_file : Path
        Made where it is not there; the answers in the making lie beside it.
    n, seed, rows_hz
        See `benchmarks.diagnose.hidden_effects.cases.design`.
    show : callable, optional
        Takes lines of progress.
    """
    folder, answers = out / "cases", key_file.parent / f"{key_file.name}.open"
    folder.mkdir(parents=True, exist_ok=True)
    answers.mkdir(parents=True, exist_ok=True)
    if not key_file.exists():
        key_file.write_bytes(secrets.token_bytes(32))
        key_file.chmod(0o600)
    cases = design(n, seed, rows_hz)
    for done, case in enumerate(cases):
        write_case(case, folder, answers)
        if (done + 1) % 20 == 0 or done + 1 == n:
            show(f"{done + 1} of {n} cases")
    known = {case.case_id: json.loads((answers / f"{case.case_id}.json").read_text("utf-8")) for case in cases}
    data = seal({"cases": known, "n": n, "seed": seed, "rows_hz": rows_hz}, key_file.read_bytes())
    (out / "sealed.bin").write_bytes(data)
    shutil.rmtree(answers)
    return hashlib.sha256(data).hexdigest()


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cases", type=int, default=_CASES)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows-hz", type=float, help="all logs are tables of so many rows a second")
    parser.add_argument("--key", type=Path, help="key file, by default beside --out")
    given = parser.parse_args(arguments)
    key = given.key or given.out.parent / f"{given.out.name}.answer.key"
    print(f"sealed.bin sha256 {write_all(given.out, key, given.cases, given.seed, given.rows_hz)}")


if __name__ == "__main__":
    main()

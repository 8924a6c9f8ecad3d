"""Every command that writes to a warehouse, on the smallest fleet that it has something to do with; for `kill_torn`.

Each is typed as a person types it and begins with a copy of a prepared warehouse. Typed once more it may say that there
is nothing left to do: those errors are named with it.
"""

from __future__ import annotations

import gzip
import os
import shutil
import sys
import tarfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path

import polars as pl
import yaml

from kempf.schemas.errors import KempfError
from kempf.schemas.instants import iso_utc
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.code import code_version
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, notes, parameter_sets, purges, segments, vessels
from kempf.warehouse.tables.segments import Segment
from kempf.warehouse.upkeep import compaction

VESSEL = "ferry"
_DAY_NS = 86_400_000_000_000
_EARLIER = Path(__file__).parents[2] / "tests" / "workbench" / "earlier_warehouse.tar.xz"
_NOTE = "docked, hull cleaned"
#: Seconds of a log in which her first zigzag is half done.
_HALF_S = 170
_REASON = ("--reason", "rehearsal")
#: What is typed does something to a warehouse; the folder has logs, profiles and an inbox.
Run = Callable[[Warehouse, Path], None]


def _nothing(warehouse: Warehouse) -> list[str]:
    return []


@dataclass(frozen=True)
class Job:
    """One command, or one way to call it."""

    run: Run
    #: Which of `BEGINS` it begins with; None for no warehouse at all.
    begin: str | None
    #: Codes of the errors that say that it was done before.
    done: frozenset[str] = frozenset()
    #: Where it is killed.
    places: frozenset[str] = frozenset({"local", "S3"})
    #: What has to be gone beside what the tables say, and is still there; a phrase each.
    left: Callable[[Warehouse], list[str]] = _nothing


def kempf(warehouse: Warehouse, *words: object, leaves: Sequence[int] = (0,)) -> None:
    """Do what the command line does; raises the error that it would print.

    Raises
    ------
    RuntimeError
        It leaves with a code that is not expected.
    """
    from kempf.workbench.cli.entry import cli

    arguments = [*map(str, words), "--warehouse", warehouse.uri]
    try:
        code = cli.main(args=arguments, prog_name="kempf", standalone_mode=False)
    except SystemExit as leaving:
        code = leaving.code
    if (code or 0) not in leaves:
        raise RuntimeError(f"kempf {' '.join(arguments)} left with {code}")


def harbour(folder: Path) -> Path:
    """Write two logs of one ship, her profile and another one of hers, and an inbox."""
    from kempf.pipeline.simulate.csv_log import to_csv
    from kempf.pipeline.simulate.logger_profile import logger_profile
    from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings

    folder.mkdir(parents=True)
    for day in range(2):
        settings = zigzag_settings(VESSEL, duration_s=300.0, steady_s=40.0, seed=day)
        settings = replace(settings, start_utc_ns=settings.start_utc_ns + day * _DAY_NS)
        data = gzip.decompress(to_csv(simulate_trial(settings), rate_hz=2.0))
        (folder / f"day{day}.csv.gz").write_bytes(gzip.compress(data, mtime=0))
    own = logger_profile(settings)
    _write_profile(folder / "profile.yaml", own)
    _write_profile(folder / "other.yaml", own.model_copy(update={"wind_arm_per_m": 0.005}))
    _write_profile(folder / "sloop.yaml", own.model_copy(update={"vessel": "sloop"}))
    for name, what in ((VESSEL, ("day0.csv.gz", "profile.yaml")), ("fery", ("day1.csv.gz",))):
        (folder / "inbox" / name).mkdir(parents=True)
        for one in what:
            shutil.copy2(folder / one, folder / "inbox" / name)
    return folder


def _write_profile(path: Path, profile: VesselProfile) -> None:
    content = profile.model_dump(mode="json", exclude_defaults=True)
    path.write_text(yaml.safe_dump(content), encoding="utf-8")


def typed(*words: str) -> Run:
    """Type a command whose words do not depend on what is in the warehouse; ``{logs}`` is the folder of the logs."""

    def run(warehouse: Warehouse, folder: Path) -> None:
        kempf(warehouse, *(word.replace("{logs}", str(folder)) for word in words))

    return run


def _inbox(warehouse: Warehouse, folder: Path) -> None:
    kempf(warehouse, "inbox", folder / "inbox", "--settle", 0, leaves=(3,))  # one file is in quarantine


def zigzag(warehouse: Warehouse) -> Segment:
    """The first zigzag, whatever was said of it."""
    return min((s for s in segments.found_in(warehouse, VESSEL) if s.is_zigzag), key=lambda s: s.start_utc_ns)


def _segments(action: str, warehouse: Warehouse, folder: Path) -> None:
    kempf(warehouse, "segments", action, zigzag(warehouse).segment_id, *_REASON, "--yes")


def _correct(seconds: int, warehouse: Warehouse, folder: Path) -> None:
    """Let the first zigzag end so long after its log begins."""
    own = zigzag(warehouse)
    end = iso_utc(logs.of_ingest(warehouse, own.ingest_id).start_utc_ns + seconds * 1_000_000_000)
    kempf(warehouse, "segments", "correct", own.segment_id, "--end", end, *_REASON, "--yes")


def _add(warehouse: Warehouse, folder: Path) -> None:
    """Add the rest of the first zigzag, which was given an earlier end."""
    row = min(logs.current(warehouse, VESSEL), key=lambda one: one.start_utc_ns)
    start, end = iso_utc(row.start_utc_ns + _HALF_S * 1_000_000_000), iso_utc(row.end_utc_ns - 2_000_000_000)
    kempf(warehouse, "segments", "add", row.log_id, "--start", start, "--end", end, *_REASON, "--yes")


def _note(warehouse: Warehouse, folder: Path) -> None:
    """Write a note where it is not there: who was interrupted looks before writing it once more."""
    if not any(one.text == _NOTE for one in notes.of_vessel(warehouse, VESSEL)):
        kempf(warehouse, "note", _NOTE, "--vessel", VESSEL, "--at", "2025-06-01")


def _alias(warehouse: Warehouse, folder: Path) -> None:
    names = parameter_sets.summaries(warehouse, VESSEL)["parameter_set_id"].to_list()
    kempf(warehouse, "params", "alias", "trial", min(names))


def _vacuum(warehouse: Warehouse, folder: Path) -> None:
    """As ``kempf compact --vacuum``, which spares what is younger than a day."""
    compaction.compact(warehouse, 1)
    compaction.vacuum(warehouse, 0.0)


def _report(warehouse: Warehouse, folder: Path) -> None:
    page = folder.parent / f"report-{os.getpid()}.html"
    try:
        kempf(warehouse, "report", "--vessel", VESSEL, "--output", page)
    finally:
        page.unlink(missing_ok=True)


def _as_other_code(run: Run, warehouse: Warehouse, folder: Path) -> None:
    """Let what is made count as that of an earlier version of the code."""
    code_version.fingerprint = lambda stage: "e" * 16  # type: ignore[assignment] - this process ends with it
    run(warehouse, folder)


def _in_turn(*runs: Run) -> Run:
    def run(warehouse: Warehouse, folder: Path) -> None:
        for one in runs:
            one(warehouse, folder)

    return run


def _flip(warehouse: Warehouse, folder: Path) -> None:
    """Damage a data file, a commit and a seal."""
    assert warehouse.folder is not None
    data = sorted((warehouse.folder / "readings").rglob("*.parquet"))[0]
    content = bytearray(data.read_bytes())
    content[len(content) // 2] ^= 1
    data.write_bytes(content)
    sorted((warehouse.folder / "logs" / "_delta_log").glob("*.json"))[-1].write_bytes(b"")
    sorted((warehouse.folder / "segments" / "_seals" / "data").iterdir())[0].write_bytes(b"")


def _raw_alone(warehouse: Warehouse, folder: Path) -> None:
    assert warehouse.folder is not None
    for path in warehouse.folder.iterdir():
        if path.is_dir() and path.name != "raw":
            shutil.rmtree(path)


def _unpack(warehouse: Warehouse, folder: Path) -> None:
    assert warehouse.folder is not None
    with tarfile.open(_EARLIER) as packed:
        packed.extractall(warehouse.folder.parent / "unpacked", filter="data")
    (warehouse.folder.parent / "unpacked" / "warehouse").rename(warehouse.folder)


def _fleet(warehouse: Warehouse, folder: Path) -> None:
    """Ships of another profile than they were identified with."""
    from benchmarks.fleet.kill_dask import stocked

    stocked(Path(warehouse.uri))
    for name in vessels.names(warehouse):
        profile = vessels.current(warehouse, name).model_copy(update={"wind_arm_per_m": 0.005})
        vessels.register(warehouse, name, profile)


def _not_purged(warehouse: Warehouse) -> list[str]:
    """Name the files that still have something of the log that was purged, in any version of any table."""
    names = set(purges.of_logs(warehouse))
    ingests = {one.ingest_id for one in logs.all_ingests(warehouse) if one.log_id in names}
    found = [path for path in warehouse.paths_below("raw") if any(name in path for name in names)]
    for path in warehouse.paths_below():
        parts = path.split("/")
        measured = {"readings", "rejected", "lost", "examinations"} & set(parts)
        if measured and ".parquet#" in path:  # half written
            found.append(path)
        if measured and path.endswith(".parquet") and "_delta_log" not in parts:
            with warehouse.opened(*parts) as stream:
                try:
                    held = set() if stream is None else set(pl.read_parquet(stream, columns=["ingest_id"])["ingest_id"])
                except Exception as error:  # noqa: BLE001 - whatever the reader says, what is in it is not known
                    found.append(f"{path} ({type(error).__name__})")
                    continue
            if held & ingests:
                found.append(path)
    return found


_INGEST = typed("ingest", "{logs}/day0.csv.gz", "{logs}/day1.csv.gz", "--profile", "{logs}/profile.yaml")
_IDENTIFY = typed("identify", "--vessel", VESSEL)
_REMOVE = typed("logs", "remove", "day0.csv.gz", *_REASON, "--yes")
_SET = typed("vessels", "set", VESSEL, "--profile", "{logs}/other.yaml")
_EFFECT = typed("effects", "add", "yaw_quadratic", "--vessel", VESSEL, "--force")
_DIAGNOSE = typed("diagnose", "--vessel", VESSEL)
_ADOPT = typed("rerun", "--all", "--preview", "--adopt")

#: Warehouses to begin with: what each is made from, None for nothing, and how.
BEGINS: Mapping[str, tuple[str | None, Run]] = {
    "ingested": (None, _INGEST),
    "stocked": ("ingested", _in_turn(_IDENTIFY, _note)),
    "changed": ("stocked", _SET),
    "two ships": ("stocked", typed("vessels", "set", "sloop", "--profile", "{logs}/sloop.yaml")),
    "removed": ("stocked", _REMOVE),
    "excluded": ("stocked", partial(_segments, "exclude")),
    "shortened": ("stocked", partial(_correct, _HALF_S - 1)),
    # so that a file is refused for the same reason whenever it is looked at
    "registered": (None, typed("vessels", "set", VESSEL, "--profile", "{logs}/profile.yaml")),
    "quarantined": ("registered", _inbox),
    "with an effect": ("stocked", _EFFECT),
    "diagnosed": ("stocked", _DIAGNOSE),
    "of other code": (None, partial(_as_other_code, _in_turn(_INGEST, _IDENTIFY))),
    "adopted": ("of other code", _ADOPT),
    "damaged": ("stocked", _flip),
    "raw alone": ("stocked", _raw_alone),
    "earlier": (None, _unpack),
    "fleet": (None, _fleet),
}


def _job(begin: str | None, run: Run, *done: str) -> Job:
    return Job(run, begin, frozenset(done))


_REPAIR = typed("repair", "--yes")
#: By the command as a person types it; what follows a comma distinguishes two jobs of one command.
JOBS: Mapping[str, Job] = {
    "ingest": _job(None, _INGEST),
    "inbox": _job("registered", _inbox),
    "identify": _job("ingested", _IDENTIFY),
    "reprocess": _job("changed", typed("reprocess", "--vessel", VESSEL)),
    "reprocess, a fleet": Job(typed("reprocess"), "fleet", places=frozenset({"local", "Dask"})),
    "params alias": _job("stocked", _alias),
    "effects add": _job("stocked", _EFFECT, "effect_there"),
    "effects undo": _job("with an effect", typed("effects", "undo", "--vessel", VESSEL), "no_parent"),
    "diagnose": _job("stocked", _DIAGNOSE),
    "report": _job("stocked", _report),
    "rerun --all": _job("stocked", typed("rerun", "--all")),
    "rerun --adopt": _job("of other code", _ADOPT),
    "rerun --unadopt": _job("adopted", typed("rerun", "--unadopt")),
    "note": _job("ingested", _note),
    "segments correct": _job("stocked", partial(_correct, 300), "nothing_to_correct"),
    "segments exclude": _job("stocked", partial(_segments, "exclude"), "nothing_to_correct"),
    "segments accept": _job("excluded", partial(_segments, "accept"), "nothing_to_correct"),
    "segments add": _job("shortened", _add, "bounds_overlap"),
    "logs remove": _job("stocked", _REMOVE, "no_log"),
    "logs restore": _job("removed", typed("logs", "restore", "day0.csv.gz"), "no_log"),
    "logs move": _job(
        "two ships", typed("logs", "move", "day0.csv.gz", "--vessel", "sloop", *_REASON, "--yes"), "log_is_hers"
    ),
    "logs release": _job(
        "quarantined", typed("logs", "release", "fery/day1.csv.gz", "--vessel", VESSEL), "not_in_quarantine"
    ),
    "logs dismiss": _job("quarantined", typed("logs", "dismiss", "fery/day1.csv.gz", *_REASON), "not_in_quarantine"),
    "vessels set": _job("stocked", _SET),
    "vessels rename": _job("stocked", typed("vessels", "rename", VESSEL, "sloop", *_REASON, "--yes"), "no_vessel"),
    "vessels remove": _job("stocked", typed("vessels", "remove", VESSEL, *_REASON, "--yes"), "no_vessel"),
    "compact": _job("stocked", typed("compact", "--more-files-than", "1")),
    "compact --vacuum": _job("stocked", _vacuum),
    "purge": Job(typed("purge", "day0.csv.gz", *_REASON, "--yes"), "diagnosed", left=_not_purged),
    "repair, of flipped bits": Job(_REPAIR, "damaged", places=frozenset({"local"})),
    "repair, of raw logs alone": _job("raw alone", _REPAIR),
    "migrate": _job("earlier", typed("migrate", "--yes")),
}

#: Commands that make a warehouse of their own in a new folder, by ``ingest``, ``identify`` and ``rerun``.
OF_THEIR_OWN = ("demo", "reproduce-paper")


def command_of(job: str) -> str:
    """Return the command of a job without its options.

    Examples
    --------
    >>> command_of("rerun --adopt"), command_of("repair, of flipped bits"), command_of("logs move")
    ('rerun', 'repair', 'logs move')
    """
    return job.partition(",")[0].partition(" --")[0]


def work(name: str, uri: str, environ: Mapping[str, str], folder: Path, log: Path, begun: Connection) -> None:
    """Do one job in a process of its own; it leaves with 0 where all is done.

    Parameters
    ----------
    name : str
        One of `JOBS`, or of `BEGINS`.
    environ : mapping of str
        How the warehouse and the cluster are reached.
    log : Path
        What is printed goes there.
    begun : Connection
        Is called when the work begins.
    """
    run, done = (JOBS[name].run, JOBS[name].done) if name in JOBS else (BEGINS[name][1], frozenset[str]())
    os.environ.update(environ, DO_NOT_TRACK="1", NO_COLOR="1")
    sys.stdout = sys.stderr = out = log.open("w", encoding="utf-8", buffering=1)
    begun.send(time.time())
    try:
        run(Warehouse(uri), folder)
    except KempfError as error:
        out.write(f"[{error.code}] {error}\n")
        if error.code not in done:
            raise

"""``kill -9`` over every writing command, in a folder with a torn file, in a bucket, on Dask: what becomes of it.

``python -m benchmarks.fleet.kill_torn``. Each kill begins with a copy of a prepared warehouse. In a folder the file
that was written last then loses a random part of its end, as where the power fails before it is on the disk. The same
command is given once more; where it refuses, or `kempf verify` names something, `kempf repair` is run and then the
command. Then every table is held against an undisturbed run's. ``--work FOLDER`` keeps the results as they come, so
that a run that was interrupted goes on; ``--only local/ingest/3`` makes one kill alone again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zlib import crc32

import numpy as np

from benchmarks.fleet.kill import seen
from benchmarks.fleet.torn_jobs import JOBS, OF_THEIR_OWN, command_of, harbour
from benchmarks.fleet.torn_places import Place, Prepared, cut_newest, opened, warm_up
from benchmarks.result_page import table, write
from kempf.flows.jobs.repair.repair_warehouse import repair
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.verify import verify

#: Kills a place.
KILLS = {"local": 140, "S3": 30, "Dask": 30}
_SEED = 31
#: Jobs of which only files are torn that they wrote themselves: what an earlier version wrote is mended by that one,
#: and raw logs without tables are the last that is left.
_OWN_FILES_ONLY = ("migrate", "repair, of raw logs alone")
#: How far from a write a moment is drawn, s.
_ABOUT_S = 0.02
Content = Mapping[str, Sequence[Mapping[str, Any]]]


@dataclass(frozen=True)
class Torn:
    """One kill: when, what was cut, and how it ended."""

    place: str
    job: str
    number: int
    #: s after the job began; how long it takes undisturbed.
    moment_s: float
    whole_s: float
    #: Whether it was still running, and whether it had written anything.
    in_time: bool
    wrote: bool
    #: What was killed, and which file was cut.
    killed: str
    cut: str
    #: again: one more run made all whole. repaired: `kempf verify` named it, or the run refused, and repair mended it.
    #: wrong: neither.
    ended: str
    #: What was named or refused before the repair, and what differs in the end.
    named: list[str] = field(default_factory=list)
    differs: list[str] = field(default_factory=list)

    @property
    def key(self) -> str:
        """By which ``--only`` makes it again."""
        return f"{self.place}/{self.job}/{self.number}"


@dataclass(frozen=True)
class Undisturbed:
    """What a job does where nobody disturbs it."""

    whole_s: float
    #: When each file that is no seal was written, s after it began; empty where the place does not tell.
    writes_s: Sequence[float]
    content: Content


def shares(kills: int, place: str) -> dict[str, int]:
    """Return how often each job is killed in a place: as evenly as it can be."""
    names = [name for name, job in JOBS.items() if place in job.places]
    return {name: kills // len(names) + (k < kills % len(names)) for k, name in enumerate(names)}


def undisturbed(place: Place, job: str, begin: Path | None) -> Undisturbed:
    """Do a job to its end; what it made stays for the runs that go on."""
    name = f"{job} undisturbed"
    known = place.folder / f"{name}.json"
    if not known.exists() or not place.stays:
        for _ in range(place.warm):
            place.fill(name, begin)
            one = place.start(job, name)
            if not one.ended_well():
                raise RuntimeError(f"{job} failed undisturbed: {one.log.read_text()[-2000:]}")
            whole_s = time.time() - one.since
        known.write_text(json.dumps([whole_s, place.written(name, one.since)]), encoding="utf-8")
    warehouse = place.warehouse(name)
    left = JOBS[job].left(warehouse)
    if left:
        raise RuntimeError(f"{job}, undisturbed, leaves {left}")
    return Undisturbed(*json.loads(known.read_text(encoding="utf-8")), _content(warehouse))


def kill_once(place: Place, job: str, number: int, begin: Path | None, wanted: Undisturbed, seed: int) -> Torn:
    """Kill a job after a while, cut what was written last, go on, compare."""
    random = np.random.default_rng([seed, crc32(f"{place.name}/{job}".encode()), number])
    moment_s = float(random.uniform(0.0, wanted.whole_s))
    if number % 2 and wanted.writes_s:
        # every other one about a write: most of the time of a command goes by without any
        moment_s = max(0.0, float(random.choice(wanted.writes_s) + random.uniform(-_ABOUT_S, _ABOUT_S)))
    name = "killed"
    place.fill(name, begin)
    one = place.start(job, name)
    time.sleep(max(0.0, one.since + moment_s - time.time()))
    in_time = one.process.is_alive()
    killed = place.kill(one, number)
    wrote = bool(place.written(name, one.since)) if place.tears else True
    cut = "none"
    if place.tears:
        since = one.since if job in _OWN_FILES_ONLY else None
        cut = cut_newest(place.folder / name, random, since)
    warehouse = place.warehouse(name)
    how, named = "again", _refused(place, job, name) + _named(warehouse)
    differs = [] if named else _differs(wanted.content, warehouse, job)
    if named:
        how = "repaired"
        try:
            repair(warehouse)
        except KempfError as error:
            named.append(f"repair: [{error.code}] {error}")
        differs = _refused(place, job, name) + _named(warehouse) + _differs(wanted.content, warehouse, job)
    how = "wrong" if differs else how
    facts = (place.name, job, number, round(moment_s, 3), round(wanted.whole_s, 3), in_time, wrote, killed, cut, how)
    return Torn(*facts, named, differs)


def _refused(place: Place, job: str, name: str) -> list[str]:
    """Do a job once more; return what it says where it does not end well."""
    one = place.start(job, name)
    return [] if one.ended_well() else [f"{job}: {one.log.read_text()[-400:].strip()}"]


def _named(warehouse: Warehouse) -> list[str]:
    try:
        return [one.words for one in verify(warehouse)]
    except KempfError as error:
        return [f"verify: [{error.code}] {error}"]


def _content(warehouse: Warehouse) -> Content:
    """Return what a warehouse says, whichever commit of the source is said to have made it."""
    said = {
        name: [{k: v for k, v in row.items() if k != "git_commit"} for row in rows]
        for name, rows in seen(warehouse).items()
    }
    for row in said["parameter_sets"]:
        row["provenance_json"] = json.dumps({**json.loads(row["provenance_json"]), "git_commit": None}, sort_keys=True)
    return said


def _differs(wanted: Content, warehouse: Warehouse, job: str) -> list[str]:
    try:
        found = _content(warehouse)
    except KempfError as error:
        return [f"[{error.code}] {error}"]
    words = []
    for name in sorted({*wanted, *found}):
        one, other = ([json.dumps(row, sort_keys=True) for row in c.get(name, ())] for c in (wanted, found))
        missing, more = Counter(one) - Counter(other), Counter(other) - Counter(one)
        if missing or more:
            shown = [f"{sign} {row[:300]}" for sign, rows in (("-", missing), ("+", more)) for row in list(rows)[:2]]
            words.append(f"{name}: {missing.total()} rows missing, {more.total()} too many: {'; '.join(shown)}")
    return words + [f"still there: {what}" for what in JOBS[job].left(warehouse)]


def measure(work: Path, kills: Mapping[str, int], seed: int, only: str | None = None) -> Iterator[Torn]:
    """Kill every job in every place; those that are in ``work`` already are taken from there."""
    results, logs = work / f"results-{seed}.jsonl", work / "harbour"
    lines = results.read_text(encoding="utf-8").splitlines() if results.exists() else []
    known = {one.key: one for one in (Torn(**json.loads(line)) for line in lines)}
    if not logs.exists():
        harbour(work / "harbour-begun").rename(logs)
    prepared = Prepared(Place(work / "prepared", logs))
    todo = [(p, j, k) for p, n in kills.items() for j, many in shares(n, p).items() for k in range(many)]
    if only is not None:
        place, job, number = only.split("/")
        todo, known = [(place, job, int(number))], {}
    there: dict[str, Place] = {}
    wanted: dict[tuple[str, str], Undisturbed] = {}
    with ExitStack() as stack:
        for done, (where, job, number) in enumerate(todo, start=1):
            key = f"{where}/{job}/{number}"
            if key not in known:
                if where not in there:
                    there[where] = stack.enter_context(opened(where, work, logs))
                place, begin = there[where], prepared.begin(JOBS[job].begin)
                if (where, job) not in wanted:
                    wanted = {(where, job): undisturbed(place, job, begin)}  # one at a time is in memory
                known[key] = kill_once(place, job, number, begin, wanted[where, job], seed)
                if only is None:
                    with results.open("a", encoding="utf-8") as stream:
                        stream.write(json.dumps(asdict(known[key])) + "\n")
                _tell(known[key], done, len(todo), seed)
                if only is not None:
                    _keep(place, key)
            yield known[key]


def _tell(one: Torn, done: int, of: int, seed: int) -> None:
    """Print one kill; of a wrong one what differs, and how to make it again."""
    at = f"{one.moment_s:.2f} of {one.whole_s:.2f} s"
    print(f"{done} of {of}: {one.key}: {one.killed} killed at {at}, cut: {one.cut}: {one.ended}", flush=True)
    if one.ended == "wrong":
        for words in one.named:
            print(f"    named: {words}")
        for words in one.differs:
            print(f"    differs: {words}")
        print(f"    once more: python -m benchmarks.fleet.kill_torn --seed {seed} --only {one.key!r}", flush=True)


def _keep(place: Place, key: str) -> None:
    if place.tears:
        print(f"{place.folder / 'killed'} is what became of {key}")


def page(found: Sequence[Torn]) -> list[str]:
    """Return the lines of the page."""
    rows = []
    for where in dict.fromkeys(one.place for one in found):
        for job in dict.fromkeys(one.job for one in found if one.place == where):
            torn = [one for one in found if (one.place, one.job) == (where, job)]
            ends, cuts = Counter(one.ended for one in torn), Counter(one.cut for one in torn)
            cut = ", ".join(f"{count} {what}" for what, count in sorted(cuts.items()) if what != "none")
            row = [where, f"`{job}`", str(len(torn)), str(sum(one.in_time for one in torn)), cut or "-"]
            rows.append([*row, *(str(ends[how]) for how in ("again", "repaired", "wrong"))])
    good = sum(one.ended != "wrong" for one in found)
    places = Counter(one.place for one in found)
    victims = Counter(one.killed for one in found if one.place == "Dask")
    commands = sorted({command_of(one.job) for one in found})
    lines = [
        f"After **{good} of {len(found)}** kills everything was whole: by one more run of the same command, or because "
        "it refused or `kempf verify` named the damage, and `kempf repair` and the command mended it "
        f"({', '.join(f'{count} {where}' for where, count in places.items())}).",
        "",
        f"Killed were all commands that write to a warehouse: {', '.join(f'`{one}`' for one in commands)}. "
        f"{' and '.join(f'`{one}`' for one in OF_THEIR_OWN)} make one of their own by `ingest`, `identify` and "
        "`rerun`; `doctor` stores nothing.",
        "",
        *table(
            ["place", "command", "kills", "before its end", "file cut", "whole again", "named and repaired", "wrong"],
            rows,
        ),
        "",
        "*Local*: the file that was written last, be it by the command or before it, loses a random part of its end; "
        "of `migrate`, whose warehouse is of an earlier version, and of a repair of raw logs alone, which are all that "
        "is left, only a file that the command wrote. *S3*: an object is "
        "put whole or not at all, so nothing can be torn there; the process that writes is killed, and the command "
        f"given once more. *Dask*: two workers in a local folder; {victims['worker']} times a worker was killed, "
        f"{victims['run']} times the run itself, and when all was still the file written last was cut.",
        "",
        "Every other moment is drawn evenly over the time that the command takes undisturbed, the others within "
        f"{1000 * _ABOUT_S:g} ms of one of its writes. *Whole again*: after one more run of the command. *Whole*: the "
        "rows of every table that a recorded log leads to, and the raw bytes, are those of an undisturbed run, and "
        "`kempf verify` finds nothing; after a purge, too, no file of any version holds anything of the log. `note` is "
        "given again where it is not listed; `compact --vacuum` spares no young file.",
    ]
    wrong = [one for one in found if one.ended == "wrong"]
    if wrong:
        lines += ["", "Wrong:", ""]
        lines += [f"- `--only '{one.key}'`, cut: {one.cut}: {'; '.join(one.differs)[:300]}" for one in wrong]
    return lines


def main() -> None:
    """Kill, cut and write ``results/kill_torn.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    for place, kills in KILLS.items():
        parser.add_argument(f"--{place.lower()}", type=int, default=kills, help=f"kills there, default {kills}")
    parser.add_argument("--seed", type=int, default=_SEED)
    parser.add_argument("--work", type=Path, help="folder in which warehouses and results are kept, to go on")
    parser.add_argument("--only", metavar="PLACE/COMMAND/NUMBER", help="this kill alone; no page is written")
    given = parser.parse_args()
    warm_up()
    kills = {place: getattr(given, place.lower()) for place in KILLS}
    with ExitStack() as stack:
        work = given.work or Path(stack.enter_context(TemporaryDirectory(ignore_cleanup_errors=True)))
        work = work.resolve()
        work.mkdir(parents=True, exist_ok=True)
        found = list(measure(work, kills, given.seed, given.only))
    if given.only is not None:
        return
    defaults = {**{place.lower(): n for place, n in KILLS.items()}, "seed": _SEED}
    options = " ".join(f"--{key} {getattr(given, key)}" for key, n in defaults.items() if getattr(given, key) != n)
    path = write("fleet.kill_torn", "Killed, and the file written last cut off", page(found), options=options)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()

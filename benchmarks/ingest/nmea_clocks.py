"""What the clocks of an NMEA log do to the hull that is identified from it: a zigzag with each of their troubles.

A simulated mariner sails a 20/20 zigzag. Her log is written again as loggers, receivers and displays would that are
off, coarse or late, and each is identified from; what comes out is compared with the log as it should be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import result_page
from benchmarks.ingest.restamped import Sentence, burst, iso, sentences_of, whole_second, written
from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.errors import DataRejected, NotFound
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse

HULL = ("a11", "a12", "a21", "a22", "b1", "b2")
SETTINGS = zigzag_settings("mariner", duration_s=820.0, seed=5)


Log = list[Sentence]


def ahead(lead: Callable[[float], float], log: Log) -> bytes:
    """By the clock of a logger that leads, s, by so much after so many seconds."""
    start = log[0].at_s
    return written(log, lambda at: iso(at + lead(at - start)))


def of(log: Log, address: str) -> Log:
    return [one for one in log if one.body.startswith(address)]


def second_receiver(late_s: float, log: Log) -> Log:
    """Return the log with a second receiver that says what the first said so long ago."""
    return log + [Sentence(one.at_s + late_s, f"GN{one.body[2:]}") for one in of(log, "GPRMC") + of(log, "GPVTG")]


def master_clock(ahead_s: float, log: Log) -> Log:
    """Return the log with the ZDA of a clock that leads by so much."""
    said = []
    for one in of(log, "GPRMC"):
        day, time = iso(one.at_s + 0.5 + ahead_s)[:22].split("T")
        year, month, of_month = day.split("-")
        said.append(Sentence(one.at_s + 0.5, f"ZQZDA,{time.replace(':', '')},{of_month},{month},{year},00,00"))
    return log + said


def repeater(log: Log) -> Log:
    """Return the log with a display that repeats the gyro twice as often, 0.8 s late and to half a degree."""
    return log + [
        Sentence(one.at_s + late, f"IIHDT,{round(2.0 * float(one.body.split(',')[1])) / 2.0 % 360.0:.1f},T")
        for one in of(log, "HEHDT")
        for late in (0.8, 0.9)
    ]


#: Every trouble by name.
TROUBLES: dict[str, Callable[[Log], bytes]] = {
    "none, stamped": lambda log: written(log, iso),
    "logger's clock 3.7 s ahead": partial(ahead, lambda _: 3.7),
    "logger's clock 2 s behind": partial(ahead, lambda _: -2.0),
    "logger's clock in local time, 2 h ahead": partial(ahead, lambda _: 7200.0),
    "logger's clock 0.9 s ahead, as a receiver that sends late": partial(ahead, lambda _: 0.9),
    "logger's clock 3 s ahead, set right on the way": partial(ahead, lambda since: 3.0 if since < 400.0 else 0.0),
    "logger's clock 0.3 % fast": partial(ahead, lambda since: 0.003 * since),
    "stamps of whole seconds": lambda log: written(log, whole_second),
    "stamps in bursts of a second": lambda log: written(log, burst),
    "a display that repeats the gyro late, twice as often": lambda log: written(repeater(log), iso),
    "none, without stamps": lambda log: written(log, None),
    "without stamps, a second receiver 2 s late": lambda log: written(second_receiver(2.05, log), None),
    "without stamps, a master clock 3 s ahead": lambda log: written(master_clock(3.0, log), None),
    "without stamps, a master clock in local time": lambda log: written(master_clock(7200.0, log), None),
}


@dataclass(frozen=True)
class Identified:
    """What came out of a log."""

    kept: float
    #: values, std: Shape (6,). Of the hull, SI; None where no zigzag was found or it was refused.
    values: np.ndarray | None
    std: np.ndarray | None
    notes: tuple[str, ...]


def identified(
    log: bytes, name: str, profile: VesselProfile, words: tuple[str, ...] = ("clock", "stamp", "bursts")
) -> Identified:
    """Take a log in and identify the hull; of the notes those are kept that hold one of some words."""
    with TemporaryDirectory() as folder:
        warehouse = Warehouse(folder)
        try:
            taken = ingest_log(warehouse, "mariner", name, LogFile(log), profile, "mariner")
        except DataRejected as why:
            return Identified(0.0, None, None, (f"refused as {why.code}",))
        tally, notes = taken.tally, tuple(note for note in taken.notes if any(word in note for word in words))
        try:
            found = identify_vessel(warehouse, "mariner")
        except NotFound:
            found = []
        made = [one.parameter_set for one in found if one.parameter_set is not None]
    kept = tally.records_kept / tally.records_read
    if len(made) != 1:
        return Identified(kept, None, None, notes)
    named = {parameter.name: parameter for parameter in made[0].parameters}
    of_hull = [named[name] for name in HULL]
    return Identified(kept, np.array([p.value for p in of_hull]), np.array([p.std for p in of_hull]), notes)


def rows(found: dict[str, Identified]) -> Iterator[tuple[str, ...]]:
    first = next(iter(found.values()))
    assert first.values is not None
    for name, one in found.items():
        if one.values is None or one.std is None:
            yield name, f"{100.0 * one.kept:.1f}", *["no hull"] * len(HULL), *(one.notes[:1] or ("none",))
        else:
            off = (one.values - first.values) / first.std
            yield name, f"{100.0 * one.kept:.1f}", *(f"{z:+.1f}" for z in off), *(one.notes[:1] or ("none",))


def main() -> None:
    """Run the benchmark and write its page."""
    log = sentences_of(simulate_trial(SETTINGS))
    found = {}
    for name, trouble in TROUBLES.items():
        found[name] = identified(trouble(log), "log.nmea", logger_profile(SETTINGS))
        print(name, found[name], flush=True)
    head = ("trouble", "kept, %", *HULL, "first note on clocks")
    lines = [
        "A zigzag of a simulated mariner, identified from her log with each trouble of its clocks. Each number of the "
        "hull: by how many of its standard errors it is off what the log gives without any.",
        "",
        *result_page.table(head, list(rows(found))),
    ]
    result_page.write("ingest.nmea_clocks", "Clocks of NMEA logs", lines)


if __name__ == "__main__":
    main()

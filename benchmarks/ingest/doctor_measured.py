"""What the channel doctor says of every measured log at hand: ``python -m benchmarks.ingest.doctor_measured``.

Each log is read with its own profile, which is right as far as is known; what is true of an instrument all the same,
such as an antenna that is not mounted along the bow, stands in `KNOWN`. ``--store FILE`` keeps what is said as JSON,
``--before FILE`` puts what an earlier version said beside it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks import measured_ships, result_page
from benchmarks.ingest.doctor_traps import examined
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.schemas.errors import KempfError
from kempf.schemas.profile import VesselProfile

#: What is wrong with a log in truth, by file name: a finding that names it accuses nobody falsely.
KNOWN = {
    "rtk_usv_202412051751.txt": "the antenna baseline is not mounted along the bow",
    "rtk_usv_202412071206_dropouts.txt": "the antenna baseline is not mounted along the bow",
    "20250710T0622.csv.gz": "the simulated ship capsizes: 61 m/s, 11,588 deg/min, a roll of thousands of degrees",
    "20251008T1001.mcap": "the simulated ship capsizes: 61 m/s, 11,588 deg/min, a roll of thousands of degrees",
}


@dataclass(frozen=True)
class Said:
    """What the doctor says of one log."""

    group: str
    file_name: str
    verdict: str
    #: One sentence a finding.
    findings: list[str]
    #: Checks by their result.
    checks: dict[str, list[str]]


def logs(data: Path) -> Iterator[tuple[str, Path, VesselProfile]]:
    """Yield every measured log: its group, its path and the profile that it is read with."""
    ships = [measured_ships.tank(data), measured_ships.pond(data), measured_ships.boat(data)]
    for ship in [*ships, *measured_ships.fleet(data), *measured_ships.fleet(data, "trials_as_sold")]:
        profile = read_profiles(ship.profiles)
        for path in ship.logs:
            yield ship.name, path, profile
    for path in sorted((data / "data" / "nmea").iterdir()):
        yield "nmea", path, VesselProfile()


def say(group: str, path: Path, profile: VesselProfile) -> Said:
    """Examine one log; one that is refused has that as its verdict."""
    try:
        content = examined(path, profile).content
    except KempfError as error:
        return Said(group, path.name, "refused", [str(error)], {})
    checks: dict[str, list[str]] = {}
    for check in content["checks"]:
        checks.setdefault(check["state"], []).append(check["check"])
    return Said(group, path.name, content["verdict"], [one["words"] for one in content["findings"]], checks)


def _words(said: dict[str, object] | None) -> str:
    if said is None:
        return "not examined"
    findings = said["findings"]
    assert isinstance(findings, list)
    return f"{said['verdict']}: {'; '.join(findings)}" if findings else str(said["verdict"])


def page(found: list[Said], before: dict[str, dict[str, object]] | None) -> list[str]:
    """Return the lines of the page."""
    head = ["ship", "log", *(["before"] if before is not None else []), "the doctor", "agree", "cannot be tested"]
    rows = []
    for one in found:
        after = _words({"verdict": one.verdict, "findings": one.findings})
        old = [] if before is None else [_words(before.get(f"{one.group}/{one.file_name}"))]
        counts = [str(len(one.checks.get(state, ()))) for state in ("agree", "untestable")]
        rows.append([one.group, one.file_name, *old, after, *counts])
    accused = [one for one in found if one.verdict in ("faults", "refused", "failed")]
    false = [one for one in accused if one.file_name not in KNOWN]
    lines = [
        "Every measured and every trial log at hand, each read with its own profile. Agree and cannot be tested: the "
        "number of checks with that result.",
        "",
        f"{len(found)} logs; {len(accused)} with a finding, {len(false)} of them false.",
    ]
    if before is not None:
        old_false = [
            key for key, one in before.items() if one["verdict"] != "clean" and one["findings"]
            and key.rpartition("/")[2] not in KNOWN
        ]  # fmt: skip
        lines[-1] += f" Before: {len(old_false)} false."
    known = [f"- {name}: {why}." for name, why in KNOWN.items()]
    return [*lines, "", "True of an instrument:", "", *known, "", *result_page.table(head, rows)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    parser.add_argument("--before", type=Path, help="what an earlier version said, from --store")
    parser.add_argument("--store", type=Path, help="write what is said here, as JSON, in place of the page")
    options = parser.parse_args()
    found = [say(*one) for one in logs(options.data)]
    if options.store:
        content = {f"{one.group}/{one.file_name}": vars(one) for one in found}
        options.store.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        return
    before = json.loads(options.before.read_text(encoding="utf-8")) if options.before else None
    lines = page(found, before)
    title = "The channel doctor on measured logs"
    given = f"--before {options.before.name}" if options.before else ""
    path = result_page.write("ingest.doctor_measured", title, lines, options=given)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()

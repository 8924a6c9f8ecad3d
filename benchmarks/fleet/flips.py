"""One bit flipped in one file of a warehouse, many times: is it ever read as other data, is it named, is it mended?

``python -m benchmarks.fleet.flips``. Every table and the raw logs are hit equally often, and in a table its data files,
commits and seals as they come. After each flip everything is read, `kempf verify` is asked, and of every fifth `kempf
repair` and `kempf reprocess` are run and the content is held against that of before.
"""

from __future__ import annotations

import argparse
import shutil
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.fleet.kill import VESSEL, harbour, seen, take_in
from benchmarks.result_page import table, write
from kempf.flows.jobs.corrections.correct_segments import plan_for
from kempf.flows.jobs.repair.repair_warehouse import repair
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import notes, raw, segments
from kempf.warehouse.upkeep.verify import verify

_FLIPS, _SEED, _EVERY = 500, 20261125, 5


@dataclass(frozen=True)
class Flip:
    """What became of one flipped bit."""

    table: str
    #: data, commit, checkpoint, seal, raw, marker
    kind: str
    #: refused: an error names it. same: the data are what they were. other: the data are others, and nothing says so.
    read: str
    named: bool
    #: None where it was not tried. whole: the content is that of before. lost: said what is lost. wrong: neither.
    mended: str | None = None


def stocked(folder: Path) -> Path:
    """Make a warehouse in which every table has rows but that of the inbox and of diagnoses."""
    place = folder / "whole"
    warehouse = Warehouse(str(place))
    take_in(warehouse, harbour(folder / "logs"))
    zigzag = segments.current(warehouse, VESSEL)[0]
    plan_for(warehouse, zigzag.segment_id, "accept", "looked at").store(warehouse)
    notes.add(warehouse, VESSEL, "vessel", VESSEL, "docked")
    reprocess_vessel(warehouse, VESSEL)
    repair(warehouse)  # seals what is not sealed yet
    return place


def everything(warehouse: Warehouse) -> dict[str, Any]:
    """Read all that a warehouse holds, the raw logs too."""
    content: dict[str, Any] = seen(warehouse)
    for name in raw.kept(warehouse):
        with raw.opened(warehouse, name) as log:
            content[name] = log.sha256
    return content


def files_of(place: Path) -> dict[str, list[Path]]:
    """Return the files of a warehouse by table; raw logs and the marker beside them."""
    found: dict[str, list[Path]] = defaultdict(list)
    for path in sorted(path for path in place.rglob("*") if path.is_file()):
        parts = path.relative_to(place).parts
        found[parts[0] if len(parts) > 1 else "marker"].append(path)
    return dict(sorted(found.items()))


def kind_of(place: Path, path: Path) -> str:
    """Return what a file is."""
    parts = path.relative_to(place).parts
    if "_seals" in parts:
        return "seal"
    if "_delta_log" in parts:
        return "checkpoint" if "checkpoint" in path.name else "commit"
    return "data" if path.suffix == ".parquet" else "raw" if parts[0] == "raw" else "marker"


def flip(path: Path, random: np.random.Generator) -> None:
    """Flip one bit of a file."""
    data = bytearray(path.read_bytes())
    at = int(random.integers(len(data)))
    data[at] ^= 1 << int(random.integers(8))
    path.write_bytes(bytes(data))


def one(place: Path, target: Path, name: str, random: np.random.Generator, wanted: Any, *, mend: bool) -> Flip:
    """Copy a warehouse, flip a bit of one of its files, read, verify, and mend it where asked."""
    kind = kind_of(place, target)
    with TemporaryDirectory() as scratch:
        copy = Path(scratch) / "w"
        shutil.copytree(place, copy)
        flip(copy / target.relative_to(place), random)
        warehouse = Warehouse(str(copy))
        try:
            read = "same" if everything(warehouse) == wanted else "other"
        except KempfError:
            read = "refused"
        try:
            named = bool(verify(warehouse))
        except KempfError:
            named = True
        mended = _mended(warehouse, wanted) if mend else None
    return Flip(name, kind, read, named, mended)


def _mended(warehouse: Warehouse, wanted: Any) -> str:
    try:
        done = repair(warehouse)
        reprocess_vessel(warehouse, VESSEL)
        after = seen(warehouse)
        left = verify(warehouse)
    except KempfError:
        return "wrong"
    same = all(wanted[name] == rows for name, rows in after.items())
    if same and not left:
        return "whole"
    # nothing but the original file gives a raw log back
    return "lost" if done.gone and all(one.kind == "raw log" for one in left) else "wrong"


def page(flips: Sequence[Flip]) -> list[str]:
    """Return the lines of the page."""
    rows = []
    for name in sorted({one.table for one in flips}):
        mine = [one for one in flips if one.table == name]
        rows.append([name, str(len(mine)), *_counts(mine)])
    rows.append(["**all**", str(len(flips)), *_counts(flips)])
    kinds = Counter(one.kind for one in flips)
    other = [one for one in flips if one.read == "other"]
    harm = [one for one in flips if one.read != "same" and not one.named]
    head = [
        "table",
        "flips",
        "read as other data",
        "refused",
        "same data",
        "named by verify",
        "mended",
        "lost, said",
        "wrong",
    ]
    return [
        f"{len(flips)} flips: **{len(other)} read as other data**, {sum(o.read == 'refused' for o in flips)} refused, "
        f"{sum(o.read == 'same' for o in flips)} without effect on what is read. Files hit: "
        f"{', '.join(f'{count} {kind}' for kind, count in sorted(kinds.items()))}. Refused and not named by verify: "
        f"{len(harm)}.",
        "",
        *table(head, rows),
        "",
        "Mended: after `kempf repair` and `kempf reprocess` everything is as before and `kempf verify` finds nothing. "
        "Lost, said: what cannot be made again (raw bytes, what people said, past versions of a table) is named, and "
        f"everything else is whole. Tried for every {_EVERY}th flip.",
    ]


def _counts(flips: Sequence[Flip]) -> list[str]:
    reads, mends = Counter(one.read for one in flips), Counter(one.mended for one in flips)
    return [
        *(str(reads[how]) for how in ("other", "refused", "same")),
        str(sum(one.named for one in flips)),
        *(str(mends[how]) for how in ("whole", "lost", "wrong")),
    ]


def main() -> None:
    """Flip bits and write ``results/flips.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flips", type=int, default=_FLIPS)
    parser.add_argument("--seed", type=int, default=_SEED)
    given = parser.parse_args()
    random = np.random.default_rng(given.seed)
    with TemporaryDirectory() as folder:
        place = stocked(Path(folder))
        wanted = everything(Warehouse(str(place)))
        files = files_of(place)
        names = sorted(files)
        flips = []
        for k in range(given.flips):
            name = names[k % len(names)]
            target = files[name][int(random.integers(len(files[name])))]
            flips.append(one(place, target, name, random, wanted, mend=k % _EVERY == 0))
            if flips[-1].read == "other" or flips[-1].mended == "wrong":
                print(flips[-1], target.relative_to(place), flush=True)
    defaults = {"flips": _FLIPS, "seed": _SEED}
    options = " ".join(f"--{name} {getattr(given, name)}" for name, n in defaults.items() if getattr(given, name) != n)
    write("fleet.flips", "Bits that flip in a warehouse", page(flips), options=options)


if __name__ == "__main__":
    main()

"""The whole benchmark by one command: ``python -m benchmarks.identify.prediction``.

With ``--work DIR`` every ship is kept as she is done, and an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path

from benchmarks import result_page
from benchmarks.identify.prediction import hidden_ship, plain_ship
from benchmarks.identify.prediction.compared import Compared, ComparedShip
from benchmarks.identify.prediction.page import page

_PLAIN, _STAMPED, _HIDDEN, _EVERY = 150, 40, 50, 12


def ship(task: tuple[str, int], work: Path | None = None) -> ComparedShip:
    """Compare one ship, or read what was found of her before.

    Parameters
    ----------
    task : (str, int)
        Kind of the ship, see `ComparedShip`, and her number.
    work : Path, optional
        Folder of what is kept.
    """
    kind, number = task
    kept = work / f"{kind}-{number}.json" if work else None
    if kept is not None and kept.exists():
        found = json.loads(kept.read_text(encoding="utf-8"))
        figures = tuple(Compared(**one) for one in found.pop("figures"))
        return ComparedShip(figures=figures, **{**found, "refused": tuple(found["refused"])})
    if kind in ("plain", "stamped"):
        made = plain_ship.compared(number, stamped=kind == "stamped")
    else:
        made = hidden_ship.compared(number, diagnosed=kind == "diagnosed")
    if kept is not None:
        kept.write_text(json.dumps(asdict(made)), encoding="utf-8")
    return made


def main() -> None:
    """Compare the ships and write ``results/prediction.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plain", type=int, default=_PLAIN, help="ships without a hidden effect")
    parser.add_argument(
        "--stamped", type=int, default=_STAMPED, help="of these, again with an instant for every reading"
    )
    parser.add_argument("--hidden", type=int, default=_HIDDEN, help="ships with one")
    parser.add_argument("--every", type=int, default=_EVERY, help="of so many with an effect one's is to be found")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--work", type=Path, help="folder in which every ship is kept as she is done")
    given = parser.parse_args()
    if given.work is not None:
        given.work.mkdir(parents=True, exist_ok=True)
    halves = [("plain", number, number / given.plain) for number in range(given.plain)]
    halves += [("stamped", number, number / given.stamped) for number in range(given.stamped)]
    for number in range(given.hidden):
        kind = "diagnosed" if number % given.every == given.every - 1 else "known"
        halves.append((kind, number, number / given.hidden))
    # both halves from the beginning, so that what an interrupted run has done is of both
    tasks = [(kind, number) for kind, number, _ in sorted(halves, key=lambda one: one[2])]
    with ProcessPoolExecutor(given.processes) as pool:
        ships = list(pool.map(partial(ship, work=given.work), tasks))
    again = sum(plain_ship.drawn(number)[1] for number in range(given.plain))
    counts = {"plain": _PLAIN, "stamped": _STAMPED, "hidden": _HIDDEN, "every": _EVERY}
    options = " ".join(f"--{name} {getattr(given, name)}" for name, n in counts.items() if getattr(given, name) != n)
    title = "Predicted manoeuvres: do the intervals hold?"
    result_page.write("identify.prediction", title, page(ships, again), options=options)


if __name__ == "__main__":
    main()

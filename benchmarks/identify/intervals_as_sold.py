"""Whether 95 % intervals hold with instruments as they are sold: ``python -m benchmarks.identify.intervals_as_sold``.

Every ship sails her two days twice in the simulator of the hidden cases, with nothing hidden: once with instruments
whose noise is fresh at every reading, once with instruments as they are sold (a receiver that smooths, noise that
lasts, a log that averages, a rudder 2 % off). Both go through the whole job, from raw logs to stored sets.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects import programme
from benchmarks.diagnose.hidden_effects.as_sold import RUDDER_OFF
from benchmarks.diagnose.hidden_effects.cases import Case
from benchmarks.diagnose.hidden_effects.taken_in import taken_in
from benchmarks.diagnose.hidden_effects.write import logs_of
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.identify.pool_vessel import pool_vessel
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.random_streams import stream
from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.warehouse.tables.parameter_set import ParameterSet

#: kinds of sets by their name on the page
KINDS = {"alone": "one zigzag", "pooled": "pooled"}
_SEED = 20261124
_COUNT = 24
#: of ships with replacement
_DRAWS = 4000


@dataclass(frozen=True, eq=False)
class Error:
    """Errors of one set's hull, in its own standard errors."""

    #: Of the ship.
    number: int
    kind: str
    sold: bool
    hull: str
    #: Shape (6,). Those of `HULL_PARAMETERS`; the ship's b1 and b2 are those of the rudder that the log shows.
    errors: NDArray[np.float64]


def errors_of(number: int, seed: int = _SEED) -> list[Error]:
    """Sail one ship of a seed with both kinds of instruments and identify her."""
    random = stream(seed, f"ship {number}")
    hull = tuple(HULLS)[number % len(HULLS)]
    weather = programme.DISTURBANCES[number // len(HULLS) % len(programme.DISTURBANCES)]
    own = int(random.integers(1, 2**31))
    case = Case(f"ship-{number}", "none", "none", hull, 1.0, weather, 0, False, ("mcap", "mcap"), own)  # noqa: FBT003
    return [one for sold in (False, True) for one in _identified(replace(case, sold=sold), number)]


def _identified(case: Case, number: int) -> Iterator[Error]:
    files, answer = logs_of(case)
    true = hull_of(case, answer)
    with TemporaryDirectory() as place:
        warehouse = taken_in(files, Path(place))
        outcomes = identify_vessel(warehouse, case.case_id, Request())
        pooled = pool_vessel(warehouse, case.case_id, Request(), outcomes)
        sets = [("alone", o.parameter_set) for o in outcomes if o.parameter_set]
        sets += [("pooled", pooled[0])] if pooled else []
        for kind, one in sets:
            yield Error(number, kind, case.sold, case.hull, in_std(one, true))


def hull_of(case: Case, answer: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return what the hull of a case truly is, shape (6,); b1 and b2 of the rudder that her log shows."""
    true = np.array([answer["hull_parameters"][name] for name in HULL_PARAMETERS])
    true[4:] /= 1.0 + RUDDER_OFF * case.sold
    return true


def in_std(one: ParameterSet, true: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the errors of a set's hull in its own standard errors, shape (6,); NaN where it states none."""
    found = {p.name: p for p in one.parameters}
    each = [(found[name].value - t, found[name].std) for name, t in zip(HULL_PARAMETERS, true, strict=True)]
    return np.array([error / std if std else np.nan for error, std in each])


def page(errors: Sequence[Error], count: int) -> list[str]:
    """Return the lines of the page."""
    lines = [
        f"{count} ships without any effect, each sailed with both kinds of instruments. How many of the 95 % intervals "
        "of a11 to b2 hold the truth, all and by hull; wanted 93 to 97 %. Beside it where the share lies in 95 % of "
        "draws of as many of these ships with replacement: the six parameters of a ship err together, and with both "
        "kinds of instruments she has the same weather and the same draws of noise:",
        "",
    ]
    hulls = list(dict.fromkeys(e.hull for e in errors))
    sizes, shares = [], []
    for sold, instruments in ((False, "fresh noise"), (True, "as sold")):
        for kind, words in KINDS.items():
            own = [e for e in errors if e.kind == kind and e.sold == sold]
            z = np.array([e.errors for e in own])
            root = np.sqrt(np.nanmean(z**2, axis=0))
            sizes.append([instruments, words, str(len(own)), *(f"{x:.2f}" for x in root)])
            by = [_inside([e for e in own if e.hull == hull]) for hull in hulls]
            shares.append([instruments, words, f"{_inside(own)}{_by_ship(own)}", *by])
    return [
        *lines,
        *result_page.table(["instruments", "set", "all", *hulls], shares),
        "",
        "Root mean square of the errors, in the standard errors that the sets state; 1 where these are right:",
        "",
        *result_page.table(["instruments", "set", "sets", *HULL_PARAMETERS], sizes),
    ]


def _inside(errors: Sequence[Error]) -> str:
    z = np.concatenate([e.errors for e in errors]) if errors else np.array([])
    z = z[np.isfinite(z)]
    return f"{100 * np.mean(np.abs(z) < NORMAL_95):.0f} %" if z.size else ""


def _by_ship(errors: Sequence[Error]) -> str:
    """Return the 95 % interval of the share by drawing ships with replacement, in brackets.

    References
    ----------
    Field and Welsh (2007), "Bootstrapping clustered data", Journal of the Royal Statistical Society B 69.
    """
    numbers = sorted({e.number for e in errors})
    if len(numbers) < 2:
        return ""
    held, count = np.zeros(len(numbers)), np.zeros(len(numbers))
    for e in errors:
        z = e.errors[np.isfinite(e.errors)]
        held[numbers.index(e.number)] += np.count_nonzero(np.abs(z) < NORMAL_95)
        count[numbers.index(e.number)] += z.size
    drawn = stream(_SEED, "ships drawn").integers(0, len(numbers), (_DRAWS, len(numbers)))
    low, high = 100.0 * np.quantile(held[drawn].sum(axis=1) / count[drawn].sum(axis=1), [0.025, 0.975])
    return f" ({low:.0f} to {high:.0f})"


def main() -> None:
    """Sail, identify and write ``results/intervals_as_sold.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ships", type=int, default=_COUNT)
    parser.add_argument("--seed", type=int, default=_SEED, help="of the ships")
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    with ProcessPoolExecutor(given.processes) as pool:
        found = list(pool.map(partial(errors_of, seed=given.seed), range(given.ships)))
    errors = [one for ship in found for one in ship]
    lines = page(errors, given.ships)
    other = {"--ships": (given.ships, _COUNT), "--seed": (given.seed, _SEED)}
    options = " ".join(f"{name} {value}" for name, (value, usual) in other.items() if value != usual)
    result_page.write(
        "identify.intervals_as_sold", "Intervals with instruments as they are sold", lines, options=options
    )


if __name__ == "__main__":
    main()

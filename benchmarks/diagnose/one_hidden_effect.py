"""Hidden cases of some effects alone, as `hidden_effects` has them: what is said, and what the true structure attains.

``python -m benchmarks.diagnose.one_hidden_effect speed_exponent propeller_wash --seed 20261127 --work DIR``.

For work on one effect: the whole of `hidden_effects` takes hours. Its cases are drawn with the same seed, and nothing
is sealed, as nobody is examined: the page judges no aim. A case whose answer lies in DIR is not diagnosed again.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from math import nan
from pathlib import Path
from typing import Any

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects.cases import Case, design
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE
from benchmarks.diagnose.hidden_effects.examine import examine
from benchmarks.diagnose.hidden_effects.oracle import with_the_truth
from benchmarks.diagnose.hidden_effects.tally import Judged, share
from benchmarks.diagnose.hidden_effects.write import write_case


def kept(path: Path, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return the content of a file, made first where it is not there."""
    if not path.exists():
        unfinished = path.with_suffix(".part")
        unfinished.write_text(json.dumps(make()), encoding="utf-8")
        unfinished.rename(path)
    content: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return content


def judge(case: Case, work: Path) -> Judged:
    """Write, diagnose and fit one case."""
    effect, place = case.effect, work / "cases" / case.case_id
    for folder in ("cases", "truth", "answers", "oracle"):
        (work / folder).mkdir(parents=True, exist_ok=True)
    write_case(case, work / "cases", work / "truth")
    truth = json.loads((work / "truth" / f"{case.case_id}.json").read_text("utf-8"))
    said = kept(work / "answers" / f"{case.case_id}.json", lambda: examine(place))
    best = kept(work / "oracle" / f"{case.case_id}.json", lambda: with_the_truth(place, effect))
    return Judged(truth, said, best)


def row(one: Judged) -> list[str]:
    """Return the line of one case in the table."""
    truth = one.truth
    sets = "; ".join(" or ".join(names) for names in one.sets) or one.verdict
    value = " ".join(f"{key} {size:.3g}" for key, size in truth["parameters"].items())
    condition = f"{truth['hull']}, noise {truth['noise']:g}, {truth['disturbance']}"
    refit = " ".join(f"{key} {p['value']:.3g} ± {p['std'] or nan:.2g}" for key, p in (one.refit or {}).items())
    gained = f"{one.expected_score:.0f}"
    return [truth["effect"], condition, "yes" if truth["sold"] else "", value, refit, gained, sets]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("effects", nargs="+", choices=sorted(CATALOGUE), metavar="EFFECT")
    parser.add_argument("--work", type=Path, default=Path("one-hidden-effect-work"))
    parser.add_argument("--cases", type=int, default=336)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    chosen = [case for case in design(given.cases, given.seed) if case.effect in given.effects]
    found = []
    for case in sorted(chosen, key=lambda case: (case.effect, case.case_id)):
        found.append(judge(case, given.work))
        print(*row(found[-1]), sep=" | ", flush=True)
    seen = [one for one in found if one.detectable]
    lines = [
        *result_page.table(
            ("hidden", "ship", "as sold", "true", "refitted, ± 1 s.e.", "score", "said"),
            [row(one) for one in found],
        ),
        "",
        f"In a set, expected score 50 or more: {share(seen, lambda one: one.found)}. The 95 % interval of the named "
        f"effect covers: {share(found, lambda one: one.covered)}.",
    ]
    options = f"{' '.join(given.effects)} --cases {given.cases} --seed {given.seed}"
    result_page.write("diagnose.one_hidden_effect", "Hidden cases of some effects", lines, options=options)


if __name__ == "__main__":
    main()

"""Open the seal and score.

``python -m benchmarks.diagnose.hidden_effects.score --cases DIR --answers ANSWERS --key KEY``.

Writes ``benchmarks/results/hidden_effects.md`` and the confusion map beside it; of tables of so many rows a second,
``hidden_effects_HZ_hz.md``. Cases that the program was not asked about yet are left out and counted.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects.draw import draw_confusion
from benchmarks.diagnose.hidden_effects.oracle import all_with_the_truth
from benchmarks.diagnose.hidden_effects.seal import open_sealed
from benchmarks.diagnose.hidden_effects.tally import Judged, kind, share, targets

_NAME = "hidden_effects"


def judged(truth: dict[str, Any], answers: Path, oracles: Path) -> list[Judged]:
    """Return the cases that were answered, in the order of their ids."""
    found = []
    for name, one in sorted(truth.items()):
        said, oracle = answers / f"{name}.json", oracles / f"{name}.json"
        if said.exists():
            best = json.loads(oracle.read_text("utf-8")) if oracle.exists() else {}
            found.append(Judged(one, json.loads(said.read_text("utf-8")), best))
    return found


def page(cases: Sequence[Judged], asked: int, name: str = _NAME) -> list[str]:
    """Return the lines of the page."""
    seconds = [one.said["seconds"]["diagnose"] for one in cases]
    lines = [
        f"{len(cases)} of {asked} cases were diagnosed: "
        + ", ".join(f"{n} {name}" for name, n in sorted(Counter(c.truth["kind"] for c in cases).items()))
        + f". A diagnosis took {median(seconds):.0f} s (median), {max(seconds):.0f} s at most. The expected score is "
        "twice the log-likelihood that the true structure gains.",
        "",
        *result_page.table(("asked", "target", "found"), targets(cases)),
        "",
        "## By effect",
        "",
        *result_page.table(
            (
                *("effect", "cases", "score >= 50", "in a set", "of these 50", "said instead"),
                *("error / plain", "error / true structure", "95 % covers"),
            ),
            [_row(name, cases) for name in sorted({c.truth["effect"] for c in cases})],
        ),
        "",
        "Errors are those of free runs of held-out manoeuvres, medians of the cases.",
        "",
        "## By condition",
        "",
    ]
    rows = []
    for what in ("hull", "noise", "disturbance", "strength", "sold"):
        for level in sorted({c.truth[what] for c in cases}):
            own = [c for c in cases if c.truth[what] == level]
            seen = [c for c in kind(own, "catalogue") if c.detectable]
            none = kind(own, "none")
            rows.append(
                (
                    *(what, str(level), str(len(own)), str(share(seen, lambda c: c.found))),
                    str(share(none, lambda c: c.verdict != "adequate")),
                )
            )
    return [
        *lines,
        *result_page.table(
            ("condition", "level", "cases", "in a set, score >= 50", "not adequate without effect"), rows
        ),
        "",
        f"![Named against true]({name}.png)",
    ]


def _row(name: str, cases: Sequence[Judged]) -> tuple[str, ...]:
    own = [c for c in cases if c.truth["effect"] == name]
    seen = [c for c in own if c.detectable]
    instead = Counter(c.named for c in own if not c.found).most_common(3)
    plain = [c.against_plain for c in own if c.against_plain is not None]
    best = [c.against_oracle for c in own if c.against_oracle is not None]
    covered = [c.covered for c in own if c.covered is not None]
    return (
        *(name, str(len(own)), str(len(seen)), str(sum(c.found for c in own)), str(sum(c.found for c in seen))),
        ", ".join(f"{what} {n}" for what, n in instead),
        f"{median(plain):.2f}" if plain else "",
        f"{median(best):.2f}" if best else "",
        f"{sum(covered)} of {len(covered)}" if covered else "",
    )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=Path, required=True, help="where write put cases/ and sealed.bin")
    parser.add_argument("--answers", type=Path, required=True)
    parser.add_argument("--key", type=Path, required=True)
    given = parser.parse_args(arguments)
    opened = open_sealed((given.cases / "sealed.bin").read_bytes(), given.key.read_bytes())
    truth = {name: one for name, one in opened["cases"].items() if (given.answers / f"{name}.json").exists()}
    oracles = given.answers.with_name(f"{given.answers.name}.oracle")
    all_with_the_truth(given.cases / "cases", truth, oracles)
    cases = judged(truth, given.answers, oracles)
    hz = opened.get("rows_hz")
    name, rows, title = (f"{_NAME}_{hz:g}_hz", f" --rows-hz {hz:g}", f" (rows of {hz:g} Hz)") if hz else (_NAME, "", "")
    draw_confusion(cases, result_page.RESULTS / f"{name}.png")
    result_page.write(
        *(f"diagnose.{_NAME}", f"Hidden effects: named, refused, missed{title}", page(cases, opened["n"], name)),
        options=f"--cases {opened['n']} --seed {opened['seed']}{rows}",
        page=name,
    )


if __name__ == "__main__":
    main()

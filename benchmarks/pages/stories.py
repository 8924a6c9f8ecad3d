"""An engineer's way through the pages, on ships of every kind: ``python -m benchmarks.pages.stories``.

In a real browser, from the logs that are sent to the effect that is undone: a ship with an effect of the catalogue that
the seed draws, one without, one whose effect has a double, one with physics that no catalogue names, and the model ship
in the towing tank, where the measured data are present. The pages know nothing of what is hidden.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from axe_playwright_python.sync_playwright import Axe

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.hidden_effects.cases import Case
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE, Kind
from benchmarks.diagnose.hidden_effects.outsiders import OUTSIDERS
from benchmarks.diagnose.hidden_effects.write import logs_of
from benchmarks.pages.browser import Opened, opened
from kempf.pipeline.simulate.random_streams import stream

_SEED = 20261127


@dataclass(frozen=True)
class Passage:
    """What was seen on the way through the pages with one ship."""

    ship: str
    hidden: str
    verdict: str
    #: Effects that the page offers to add.
    offered: tuple[str, ...]
    #: Pieces of evidence on the page of the model before anything was added, and after.
    evidence: tuple[int, int | None]
    #: Error one leg ahead of manoeuvres left out, in percent, before and after; None where nothing was added.
    error: tuple[float, float] | None
    undone: bool | None
    #: Violations that axe found on the pages gone through, and complaints of the browser.
    violations: int
    complaints: int


def simulated(seed: int) -> Iterator[tuple[str, Case]]:
    """Draw the ships."""
    random = stream(seed, "stories")
    effect = str(random.choice(sorted(CATALOGUE)))
    outsider = str(random.choice(sorted(OUTSIDERS)))
    kinds: tuple[tuple[str, Kind, str], ...] = (
        ("an effect of the catalogue", "catalogue", effect),
        ("no effect", "none", "none"),
        ("an effect with a double", "catalogue", "speed_exponent"),
        ("physics of no catalogue", "outsider", outsider),
    )
    for number, (words, kind, name) in enumerate(kinds):
        own = int(random.integers(1, 2**31))
        yield words, Case(f"ship-{number}", kind, name, "mariner", 1.0, "moderate", 2, False, ("csv", "mcap"), own)  # noqa: FBT003


def gone_through(page: Opened, vessel: str, logs: list[Path], profile: Path) -> dict[str, Any]:
    """Go from the logs of a ship to the effect that is undone, and return what was seen."""
    tab, violations = page.tab, 0

    def looked_at() -> int:
        return len(Axe().run(tab).response["violations"])

    tab.goto(f"{page.base}/ingest")
    tab.set_input_files("[name=log]", [str(log) for log in logs])
    tab.set_input_files("[name=profile]", str(profile))
    tab.check("[name=new_vessel]")
    tab.click("button:has-text('Take them in')")
    tab.click(f"main a:has-text('Go to {vessel}')")
    violations += looked_at()
    tab.click("button:has-text('Identify')")
    tab.wait_for_url(f"**/v/{vessel}")
    tab.click("text=Model beside measurement")
    if tab.query_selector("button:has-text('Predict')"):
        tab.click("button:has-text('Predict')")
        tab.wait_for_url("**/model?**")
    before = tab.locator("tr:has(a[title='Shade its instants'])").count()
    violations += looked_at()
    tab.keyboard.press("n")
    tab.wait_for_url("**&worst=1")
    tab.wait_for_selector("body[data-ready=yes]")
    violations += looked_at()
    tab.goto(f"{page.base}/v/{vessel}")
    tab.click("button:has-text('Diagnose') >> nth=0")
    tab.wait_for_url("**/diagnoses/dx-**")
    violations += looked_at()
    verdict = tab.inner_text(".verdict")
    buttons = tab.locator("main button:has-text('Add ')")
    offered = tuple(words.removeprefix("Add ") for words in buttons.all_inner_texts())
    seen: dict[str, Any] = {"verdict": verdict, "offered": offered, "error": None, "undone": None, "after": None}
    if offered:
        buttons.first.click()
        tab.wait_for_url("**/ladder")
        rungs = page.json(f"/v/{vessel}/ladder.json")
        percent = [rung["one_leg_ahead"]["left_out_percent"] for rung in rungs]
        seen["error"] = tuple(sum(one.values()) / len(one) for one in (percent[0], percent[-1]))
        violations += looked_at()
        tab.click("text=Model before and after")
        tab.wait_for_url("**beside=**")
        violations += looked_at()
        tab.keyboard.press("f")
        assert "after" in tab.inner_text("#flipped")
        seen["after"] = tab.locator("tr:has(a[title='Shade its instants'])").count()
        tab.goto(f"{page.base}/v/{vessel}/ladder")
        tab.click("button:has-text('Undo')")
        tab.wait_for_selector("text=Only the plain model so far")
        seen["undone"] = [rung["added"] for rung in page.json(f"/v/{vessel}/ladder.json")] == [None]
    return {**seen, "evidence": before, "violations": violations}


def passage(words: str, hidden: str, vessel: str, logs: list[Path], profile: Path) -> Passage:
    """Go through the pages of a new warehouse with one ship."""
    with TemporaryDirectory() as place, opened(Path(place) / "w", Path(place) / "state", "--new") as page:
        seen = gone_through(page, vessel, logs, profile)
        complaints = len(page.complaints)
    return Passage(
        ship=words,
        hidden=hidden,
        verdict=seen["verdict"],
        offered=seen["offered"],
        evidence=(seen["evidence"], seen["after"]),
        error=seen["error"],
        undone=seen["undone"],
        violations=seen["violations"],
        complaints=complaints,
    )


def every(seed: int, data: Path) -> Iterator[Passage]:
    """Go through the pages with every ship."""
    for words, case in simulated(seed):
        with TemporaryDirectory() as place:
            folder = Path(place)
            for name, content in logs_of(case)[0].items():
                (folder / name).write_bytes(content)
            logs = sorted(path for path in folder.iterdir() if path.name != "profile.yaml")
            yield passage(words, case.effect, case.case_id, logs, folder / "profile.yaml")
    tank = measured_ships.tank(data)
    yield passage("the towing tank's, measured", "not known", tank.name, list(tank.logs), tank.profiles[0])


def row(one: Passage) -> list[str]:
    """Return a ship as a row of the page."""
    first, then = one.evidence
    return [
        one.ship,
        one.hidden.replace("_", " "),
        one.verdict,
        ", ".join(one.offered) or "none",
        "-" if one.error is None else f"{one.error[0]:.1f} to {one.error[1]:.1f}",
        f"{first}" if then is None else f"{first} to {then}",
        {None: "-", True: "yes", False: "no"}[one.undone],
        str(one.violations),
        str(one.complaints),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=_SEED)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    given = parser.parse_args()
    rows = []
    for one in every(given.seed, given.data):
        rows.append(row(one))
        print(" | ".join(rows[-1]), flush=True)
    head = ["ship", "hidden, opened last", "verdict", "offered to add", "error one leg ahead, left out, %"]
    head += ["evidence", "undone", "axe", "complaints"]
    lines = [
        "From the logs that are sent by the browser: identified, her worst stretch looked at, diagnosed; where an "
        "effect is claimed the first is added, the ladder and the model before and after are looked at, and it is "
        "undone. Evidence: things that a right model would hardly leave, before and after it. Axe: violations on all "
        "pages gone through. Complaints: of the browser, violations of the pages' policy among them.",
        "",
        *result_page.table(head, rows),
    ]
    options = "" if given.seed == _SEED else f"--seed {given.seed}"
    result_page.write("pages.stories", "The way through the pages", lines, options=options)


if __name__ == "__main__":
    main()

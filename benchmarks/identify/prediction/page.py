"""The page: shares of figures inside their interval, by manoeuvre and by kind of ship."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from benchmarks.diagnose.hidden_effects.tally import Share
from benchmarks.identify.prediction.compared import AIMED, Compared, ComparedShip
from benchmarks.result_page import table

_WORDS = {
    "plain": "no effect, delimited log",
    "stamped": "no effect, every reading with its instant",
    "known": "effect given",
    "diagnosed": "effect found by the diagnosis",
}


def page(ships: Sequence[ComparedShip], again: int) -> list[str]:
    """Return the lines of the page.

    Parameters
    ----------
    again : int
        How many ships without an effect were drawn and are none.
    """
    by = {kind: [ship for ship in ships if ship.kind == kind] for kind in _WORDS}
    hidden = [*by["known"], *by["diagnosed"]]
    groups = [(words, by[kind]) for kind, words in _WORDS.items()]
    columns = [*groups[:2], ("hidden effect", hidden)]
    return [
        *_of_whom(by, again),
        "",
        "Advance, transfer, tactical diameter and the first two overshoots inside their 95 % interval, wanted 93 to "
        "97 %. The range behind a share is its own 95 % interval, from the scatter of the ships: the figures of one "
        "ship go together:",
        "",
        *table(
            ["ships", "predicted", *(_named(figure) for figure in AIMED), "all of these"],
            [
                [
                    words,
                    str(_predicted(own)),
                    *(_share(own, lambda c, f=figure: c.figure == f) for figure in AIMED),  # type: ignore[misc]
                    _share(own, lambda c: c.figure in AIMED),
                ]
                for words, own in [*groups, ("with an effect, together", hidden), ("all", list(ships))]
            ],
        ),
        "",
        "Every figure, with Wilson's 95 % interval of the share:",
        "",
        *table(["manoeuvre", "figure", *(words for words, _ in columns)], _every(columns)),
        "",
        "Median error and median width of the interval, percent of the truth:",
        "",
        *table(["manoeuvre", "figure", *(words for words, _ in columns)], _sizes(columns)),
        "",
        "By effect, the figures of the first table together:",
        "",
        *table(["effect", "ships", "inside", "of"], _effects(hidden)),
        *_refused(ships),
    ]


def _of_whom(by: Mapping[str, Sequence[ComparedShip]], again: int) -> list[str]:
    known, diagnosed = by["known"], by["diagnosed"]
    named = sum(ship.found for ship in diagnosed)
    return [
        f"**{len(by['plain'])} ships have no effect**: a hull of the catalogue, every parameter changed by 10 % (one "
        "standard deviation), speed loss and surge time drawn. Each is identified from one 20/20 and one 10/10 zigzag "
        "in wind and stream, pooled. Her log is delimited, ten rows a second that say what was last received of every "
        f"instrument: how old that is, it does not say, and instruments differ. {len(by['stamped'])} of the ships were "
        "identified once more from the same zigzags in a log that has the instant of every reading (MCAP). "
        f"{again} more were drawn and are no ships: unstable on a straight course, or, as eq. (16) has no damping that "
        "grows with the motion, sliding through a 35 deg circle with a drift of more than 56 deg or a turn of more "
        "than three radians a length.",
        "",
        f"**{len(known) + len(diagnosed)} ships have one hidden effect** that acts on the ship: none of an instrument, "
        "no waves, shallow water or roll, which a prediction for calm, deep water takes out. It is small, medium or "
        "large; they sail the two days of the hidden cases in any weather, with instruments whose noise is fresh, and "
        f"MCAP logs. **{len(known)} of them were fitted with the plain model and the true effect, without a "
        f"diagnosis**; of {len(diagnosed)} the effect was to be found: `kempf diagnose` named it in a set in {named}, "
        "and these were predicted as `kempf effects add` leaves them, with the models that the diagnosis calls as "
        "good.",
        "",
        "All are predicted at their trial speed in calm, deep water. The truth is what the same simulator sails there, "
        "with the effect; neither shares code with the prediction. The speed equations of both simulators are among "
        "the forms that the estimator weighs: these figures say nothing of a speed that falls in another way.",
    ]


def _predicted(ships: Sequence[ComparedShip]) -> int:
    return sum(bool(ship.figures) for ship in ships)


def _named(figure: str) -> str:
    if figure.startswith("overshoots_deg."):
        return f"overshoot {int(figure[-1]) + 1}"
    return figure.replace("_percent", "").replace("_deg_s", "").replace("_m", "").replace("_", " ")


def _share(ships: Sequence[ComparedShip], of: Callable[[Compared], bool]) -> str:
    """Return the share inside, with the interval that the ratio estimator of clusters gives it."""
    chosen = [[c.inside for c in ship.figures if of(c)] for ship in ships]
    pairs = np.array([[sum(own), len(own)] for own in chosen if own])
    if not len(pairs):
        return ""
    hits, counts = pairs.T
    p, n = hits.sum() / counts.sum(), len(pairs)
    half = 1.96 * np.sqrt(np.sum((hits - p * counts) ** 2) * n / max(n - 1, 1)) / counts.sum()
    return f"{100 * p:.1f} % ({100 * max(0.0, p - half):.0f}-{100 * min(1.0, p + half):.0f})"


def _every(kinds: Sequence[tuple[str, Sequence[ComparedShip]]]) -> list[list[str]]:
    rows = []
    for manoeuvre, figure in _figures(kinds):
        shares = []
        for _, ships in kinds:
            own = _of(ships, manoeuvre, figure)
            shares.append(str(Share(sum(c.inside for c in own), len(own))))
        rows.append([manoeuvre, _named(figure), *shares])
    return rows


def _sizes(kinds: Sequence[tuple[str, Sequence[ComparedShip]]]) -> list[list[str]]:
    rows = []
    for manoeuvre, figure in _figures(kinds):
        sizes = []
        for _, ships in kinds:
            own = _of(ships, manoeuvre, figure)
            error = np.median([abs(100.0 * (c.value / c.truth - 1.0)) for c in own]) if own else np.nan
            width = np.median([100.0 * (c.high - c.low) / abs(c.truth) for c in own]) if own else np.nan
            sizes.append(f"{error:.2f}, {width:.2f}")
        rows.append([manoeuvre, _named(figure), *sizes])
    return rows


def _effects(ships: Sequence[ComparedShip]) -> list[list[str]]:
    rows = []
    for effect in sorted({ship.effect for ship in ships}):
        own = [ship for ship in ships if ship.effect == effect]
        aimed = [c for ship in own for c in ship.figures if c.figure in AIMED]
        rows.append([f"`{effect}`", str(len(own)), str(sum(c.inside for c in aimed)), str(len(aimed))])
    return rows


def _figures(kinds: Sequence[tuple[str, Sequence[ComparedShip]]]) -> list[tuple[str, str]]:
    every = [c for _, ships in kinds for ship in ships for c in ship.figures]
    # of a ship whose first circle is refused the others come first
    return sorted(dict.fromkeys((c.manoeuvre, c.figure) for c in every), key=lambda pair: pair[0])


def _of(ships: Sequence[ComparedShip], manoeuvre: str, figure: str) -> list[Compared]:
    return [c for ship in ships for c in ship.figures if (c.manoeuvre, c.figure) == (manoeuvre, figure)]


def _refused(ships: Sequence[ComparedShip]) -> list[str]:
    refused = [
        f"- {s.name} {f'with `{s.effect}`' if s.effect else 'without an effect'}: {w}" for s in ships for w in s.refused
    ]
    return ["", f"Refused: {len(refused)}, in {sum(bool(s.refused) for s in ships)} ships.", "", *refused]

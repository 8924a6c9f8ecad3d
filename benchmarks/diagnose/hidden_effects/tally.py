"""Counts what the program said of the hidden cases against the opened answers; knows no file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

from benchmarks.diagnose.hidden_effects.as_sold import RUDDER_OFF
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE

#: expected score from which an effect must be named, as `DIAGNOSIS` sets it
DETECTABLE = 50.0
#: absorption above which an effect cannot be tested
ABSORBED = 0.999
#: standard errors of a paired comparison beyond which a misfit has risen, and part of it that is a rise at all
WORSE, LEAST_RISE = 2.0, 0.01


@dataclass(frozen=True)
class Judged:
    """One case: the truth, what was said, and what a fit with the true structure attains."""

    #: Opened answer.
    truth: Mapping[str, Any]
    #: As `benchmarks.diagnose.hidden_effects.examine` wrote it.
    said: Mapping[str, Any]
    #: As `benchmarks.diagnose.hidden_effects.oracle` wrote it; empty where there is none.
    oracle: Mapping[str, Any]

    @property
    def verdict(self) -> str:
        """Verdict of the program, or the code of its error."""
        found = self.said.get("diagnosis")
        return str(found["verdict"]) if found else str(self.said["error"]["code"])

    @property
    def sets(self) -> list[list[str]]:
        """Named sets, in the order in which they were found."""
        found = self.said.get("diagnosis")
        return [list(one["effects"]) for one in found["sets"]] if found else []

    @property
    def immaterial(self) -> list[list[str]]:
        """Named sets that are certain and change no prediction."""
        found = self.said.get("diagnosis")
        return [list(one["effects"]) for one in found["immaterial"]] if found else []

    @property
    def expected_score(self) -> float:
        """Twice the log-likelihood that the true structure gains; 0 where a fit could not be made."""
        return float(self.oracle.get("likelihood_ratio") or 0.0)

    @property
    def detectable(self) -> bool:
        """Whether the expected score is great enough to ask for the name."""
        return self.expected_score >= DETECTABLE

    @property
    def in_set(self) -> bool:
        """Whether a claimed set holds the true effect."""
        return any(self.truth["effect"] in one for one in self.sets)

    @property
    def found(self) -> bool:
        """Whether a set holds the true effect, one that is claimed or one that is certain but immaterial."""
        return self.in_set or any(self.truth["effect"] in one for one in self.immaterial)

    @property
    def named(self) -> str:
        """First name of the first set, or the verdict where there is none."""
        return self.sets[0][0] if self.sets else self.verdict

    @property
    def alone(self) -> str | None:
        """The name, where the first set has one member."""
        return self.sets[0][0] if self.sets and len(self.sets[0]) == 1 else None

    @property
    def held_out(self) -> tuple[float | None, float | None]:
        """Held-out errors of the plain and of the last model; infinite for one whose free run runs away."""
        found = self.said.get("diagnosis")
        first, last = (found["ladder"][k]["held_out_error"] for k in (0, -1)) if found else (None, None)
        return first, inf if first is not None and last is None else last

    @property
    def against_oracle(self) -> float | None:
        """Held-out error of the program's last model over that of the true structure."""
        best, (_, last) = self.oracle.get("held_out"), self.held_out
        return float(last / best) if last is not None and best else None

    @property
    def against_plain(self) -> float | None:
        """Held-out error of the program's last model over that of the plain one."""
        first, last = self.held_out
        return float(last / first) if last is not None and first else None

    @property
    def refit(self) -> Mapping[str, Any] | None:
        """What the diagnosis fitted for the true effect, by parameter; None where it was not named."""
        found = self.said.get("diagnosis")
        for one in (*found["sets"], *found["immaterial"]) if found else ():
            for refit in one["refits"]:
                if refit["effect"] == self.truth["effect"]:
                    parameters: Mapping[str, Any] = refit["parameters"]
                    return parameters
        return None

    @property
    def covered(self) -> bool | None:
        """Whether the 95 % interval of the refit true effect holds the true value; None where it was not named.

        A rudder's feedback that is off is in no log: its effects are true of the rudder that the log shows.
        """
        name, refit = self.truth["effect"], self.refit
        if refit is None:
            return None
        shown = (1.0 + RUDDER_OFF) ** CATALOGUE[name].of_rudder if self.truth["sold"] and name in CATALOGUE else 1.0
        key, value = next(iter(self.truth["parameters"].items()))
        std = refit[key]["std"]
        # an interval that could not be given covers nothing
        return bool(std is not None and std > 0 and abs(refit[key]["value"] - shown * value) <= 1.96 * std)

    @property
    def falls(self) -> bool | None:
        """Whether the misfit one leg ahead is smaller on the last rung than on the first; None without a step."""
        found = self.said.get("diagnosis")
        rungs = [one["one_leg_ahead"] for one in found["ladder"]] if found else []
        if len(rungs) < 2 or None in rungs:
            return None
        kinds = [f"{sample}_misfit" for sample in ("fitted", "left_out", "held_out")]
        known = [key for key in kinds if rungs[0][key] is not None and rungs[-1][key] is not None]
        return all(rungs[-1][key] < rungs[0][key] for key in known)

    @property
    def no_worse(self) -> bool | None:
        """Whether no step of the ladder makes a misfit one leg ahead larger beyond its error; None without a step."""
        found = self.said.get("diagnosis")
        steps = [one["one_leg_ahead"] for one in found["ladder"][1:]] if found else []
        if not steps or None in steps:
            return None
        beside = [one for step in steps for one in step["beside_the_rung_below"].values()]
        return not any(one["in_std"] < -WORSE and one["falls_by"] < -LEAST_RISE for one in beside)

    @property
    def present_untestable(self) -> list[str]:
        """Effects called present though the model imitates all of them."""
        found = self.said.get("diagnosis")
        asked = found["candidates"] if found else ()
        return [c["effect"] for c in asked if c["verdict"] == "present" and (c["absorption"] or 0.0) > ABSORBED]


@dataclass(frozen=True)
class Share:
    """So many of so many, with Wilson's 95 % interval (Wilson 1927)."""

    hits: int
    of: int

    def __str__(self) -> str:
        if self.of == 0:
            return "no case"
        p, z2 = self.hits / self.of, 1.96**2
        middle = (p + z2 / (2 * self.of)) / (1 + z2 / self.of)
        half = 1.96 * sqrt(p * (1 - p) / self.of + z2 / (4 * self.of**2)) / (1 + z2 / self.of)
        low, high = max(0.0, middle - half), min(1.0, middle + half)
        return f"{100 * p:.0f} % ({self.hits} of {self.of}; 95 %: {100 * low:.0f} to {100 * high:.0f} %)"


def share(cases: Sequence[Any], hit: Any) -> Share:
    """Return of how many cases ``hit`` holds; a case of which it is None does not count."""
    stated = [hit(one) for one in cases]
    stated = [one for one in stated if one is not None]
    return Share(sum(bool(one) for one in stated), len(stated))


def kind(cases: Sequence[Judged], name: str) -> list[Judged]:
    """Return the cases of one kind."""
    return [one for one in cases if one.truth["kind"] == name]


def _found(case: Judged) -> bool:
    return case.found


def targets(cases: Sequence[Judged]) -> list[tuple[str, str, str]]:
    """Return what is asked, the target and what was found, a row each."""
    none, known, outside = (kind(cases, name) for name in ("none", "catalogue", "outsider"))
    seen = [one for one in known if one.detectable]
    sizes = [len(names) for one in seen for names in one.sets]
    return [
        ("true effect in a named set, expected score 50 or more", ">= 95 %", str(share(seen, _found))),
        ("of these claimed; the others are certain but immaterial", "", str(share(seen, lambda c: c.in_set))),
        (
            "exact name where the first set has one member",
            "all",
            str(share(seen, lambda c: None if c.alone is None else c.alone == c.truth["effect"])),
        ),
        ("mean size of a set", "<= 4", f"{sum(sizes) / len(sizes):.2f}" if sizes else "no set"),
        ("named with the 3 m boat", ">= 90 %", str(share([c for c in seen if c.truth["hull"] == "usv"], _found))),
        (
            "named with instruments as they are sold",
            ">= 90 %",
            str(share([c for c in seen if c.truth["sold"]], _found)),
        ),
        ("any claim without an effect", "<= 2 %", str(share(none, lambda c: bool(c.sets)))),
        ("anything certain but immaterial without an effect", "none", str(share(none, lambda c: bool(c.immaterial)))),
        (
            "outside the catalogue: refused, or partly explained",
            ">= 90 %",
            str(share(outside, lambda c: c.verdict in ("unexplained", "partly_explained"))),
        ),
        (
            "outside the catalogue: a confident wrong name",
            "<= 5 %",
            str(share(outside, lambda c: c.verdict == "explained")),
        ),
        ("present though not testable", "never", str(share(cases, lambda c: bool(c.present_untestable)))),
        (
            "held-out error at most 1.1 times the true structure's",
            "all",
            str(share(seen, lambda c: None if c.against_oracle is None else c.against_oracle <= 1.1)),
        ),
        ("every ladder falls one leg ahead: fitted, left out, held out", "all", str(share(cases, lambda c: c.falls))),
        ("no step of a ladder rises beyond its error, in any of these", "all", str(share(cases, lambda c: c.no_worse))),
        ("95 % interval of the named effect covers", "93 to 97 %", str(share(known, lambda c: c.covered))),
    ]

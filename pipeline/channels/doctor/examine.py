"""The door of the doctor: every check on a log, and which fault explains what disagrees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from kempf.pipeline.channels.doctor import (
    heading_course,
    heading_rate,
    leap,
    misalignment,
    plausible,
    rudder_order,
    rudder_turn,
    standstill,
    track,
    water_speed,
)
from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import VELOCITIES, Log
from kempf.pipeline.channels.doctor.outcome import STILL, Outcome


class Check(Protocol):
    """One check; without its channels it returns nothing."""

    def __call__(self, log: Log, *, thorough: bool = True) -> list[Outcome]:
        """Compare channels.

        Not ``thorough``: only what takes a moment, which shows a fault but need not name it: at lags that sound clocks
        show, and without the way from fix to fix.
        """
        ...


#: Every check.
CHECKS: tuple[Check, ...] = (
    plausible.examine,
    heading_rate.examine,
    heading_course.examine,
    misalignment.examine,
    track.examine,
    water_speed.examine,
    rudder_turn.examine,
    rudder_order.examine,
    standstill.examine,
    leap.examine,
)
#: Faults that are corrected one after the other, at most.
_MOST_FAULTS = 4
#: A correction that leaves so much more over than the best one, over all checks together, is not as good.
_WORSE = 1.15
#: Faults whose correction takes channels out, and the checks of these with them.
_REMOVES = ("frame", "stuck")
#: What no check shows, by the channel that it is about.
_CANNOT_SEE = {
    "rudder_angle": "the scale of rudder_angle: a rudder that reads too much or too little by a factor contradicts no "
    "other channel, and the rudder's parameters are out by it",
}
#: Readings of a channel that a short examination looks at, at most.
_FEW = 400


@dataclass(frozen=True)
class ChannelFinding:
    """One contradiction: the faults that could cause it, and what shows it."""

    #: A single one where most of the other channels confirm it; several where it is one of these. Empty: no known fault
    #: explains it.
    faults: tuple[Fault, ...]
    #: The checks that disagree because of it, before it was corrected.
    evidence: tuple[Outcome, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that may be wrong, in the order of the faults; where none is known, all that disagree."""
        named = [c for fault in self.faults for c in fault.channels]
        return tuple(dict.fromkeys(named or [c for outcome in self.evidence for c in outcome.channels]))


@dataclass(frozen=True)
class Examination:
    """What the doctor found."""

    findings: tuple[ChannelFinding, ...]
    #: Of every check on the log as it came.
    outcomes: tuple[Outcome, ...]
    #: Channels that no check could test, by name.
    untested: tuple[str, ...]

    @property
    def still(self) -> bool:
        """Whether she does not move, so that motions could not be compared."""
        return any(outcome.words == STILL for outcome in self.outcomes)

    @property
    def cannot_see(self) -> tuple[str, ...]:
        """What could be wrong with the channels of this log without any check showing it, one sentence each."""
        there = {c for o in self.outcomes for c in o.channels} | set(self.untested)
        return tuple(words for channel, words in _CANNOT_SEE.items() if channel in there)

    @property
    def verdict(self) -> str:
        """``clean``, ``faults`` or ``untested``: nothing could be tested."""
        if self.findings:
            return "faults"
        return "clean" if any(o.state == "agree" and not o.alone for o in self.outcomes) else "untested"


def ask(log: Log) -> list[list[Outcome]]:
    """Run every check on a log; the outcomes of each, in the order of `CHECKS`."""
    return [check(log) for check in CHECKS]


def examine_window(log: Log) -> Examination:
    """Examine a short part of a log: in a moment where the channels agree, like a whole log where any are in doubt.

    Parameters
    ----------
    log : Log
        The part, from `Log.between`.

    Returns
    -------
    Examination
        Clocks are compared only where something is in doubt: a lag shows in the whole log.
    """
    few = log.thinned(_FEW)
    # a channel that repeats itself shows in all its readings only
    outcomes = [o for check in CHECKS for o in check(log if check is standstill.examine else few, thorough=False)]
    if any(o.state == "disagree" or o.doubtful for o in outcomes):
        return examine(log)
    return Examination((), tuple(outcomes), _untested(log, tuple(outcomes)))


def examine(log: Log) -> Examination:
    """Examine a log.

    What disagrees is explained by the fault whose correction makes most checks agree and none disagree that agreed
    before; faults that do so equally well are all named. What still disagrees is explained in the same way.

    References
    ----------
    Reiter (1987), "A theory of diagnosis from first principles", Artificial Intelligence 32: a diagnosis is a smallest
    set of components whose being faulty is consistent with everything that was observed.
    """
    first = answers = ask(log)
    original = log
    findings: list[ChannelFinding] = []
    if any(outcome.distrusts_length for outcome in _wrong(answers).values()):
        log = replace(log, length_m=None)
        answers = ask(log)
    for _ in range(_MOST_FAULTS):
        explained = _explained(log, answers)
        if explained is None:
            break
        faults, corrected, answers_then = explained
        before = _by_name(answers)
        findings.append(ChannelFinding(faults, tuple(before[name] for name in corrected)))
        log, answers = faults[0].corrected(log), answers_then
    if log.length_m != original.length_m:
        # a corrected channel may have made the length right
        answers[CHECKS.index(plausible.examine)] = plausible.examine(replace(log, length_m=original.length_m))
    left = tuple(_wrong(answers).values())
    findings += [ChannelFinding((), (outcome,)) for outcome in left if outcome.claim]
    if compared := tuple(outcome for outcome in left if not outcome.claim):
        findings.append(ChannelFinding((), compared))
    outcomes = tuple(_by_name(first).values())
    return Examination(tuple(findings), outcomes, _untested(original, outcomes))


def _untested(log: Log, outcomes: tuple[Outcome, ...]) -> tuple[str, ...]:
    tested = {c for o in outcomes if o.state != "untestable" and not o.alone for c in o.channels}
    return tuple(sorted(set(log.series) - tested))


def _by_name(answers: list[list[Outcome]]) -> dict[str, Outcome]:
    return {outcome.check: outcome for some in answers for outcome in some}


def _wrong(answers: list[list[Outcome]]) -> dict[str, Outcome]:
    return {name: outcome for name, outcome in _by_name(answers).items() if outcome.state == "disagree"}


@dataclass(frozen=True)
class _Trial:
    """A correction that was tried: the checks that it makes agree, and all answers after it."""

    fault: Fault
    corrects: frozenset[str]
    after: list[list[Outcome]]

    @property
    def tested(self) -> dict[str, float]:
        """What each check that could be made leaves over after the correction."""
        return {name: o.left_over for name, o in _by_name(self.after).items() if o.state != "untestable"}


def _explained(
    log: Log, answers: list[list[Outcome]]
) -> tuple[tuple[Fault, ...], tuple[str, ...], list[list[Outcome]]] | None:
    """Return the faults that explain most, the names of what they explain, and the answers after the first's."""
    suspects = _suspects(answers, log.units)
    trials = [trial for fault, by in suspects if (trial := _tried(log, fault, by, answers)) is not None]
    if not trials:
        return None
    most = max(trials, key=lambda t: (len(t.corrects), -t.fault.simplicity))
    rivals = [t for t in trials if t.corrects == most.corrects]
    # over the checks that all of them can be compared in
    shared = set.intersection(*(set(t.tested) for t in rivals))
    left = {t.fault.key: sum(t.tested[n] for n in sorted(shared)) / max(len(shared), 1) for t in rivals}
    rivals = [t for t in rivals if left[t.fault.key] <= _WORSE * min(left.values()) + 0.005]
    # of one channel's explanations the simplest; of equally simple ones that which fits best
    best: dict[tuple[str, ...], _Trial] = {}
    for trial in sorted(rivals, key=lambda t: (t.fault.simplicity, left[t.fault.key])):
        best.setdefault(trial.fault.channels, trial)
    chosen = sorted(best.values(), key=lambda t: (t.fault.simplicity, left[t.fault.key]))
    kept = [t for t in chosen if t.fault.simplicity <= max(chosen[0].fault.simplicity, 2)]
    return tuple(t.fault for t in kept), tuple(sorted(kept[0].corrects)), kept[0].after


def _suspects(answers: list[list[Outcome]], units: Mapping[str, str]) -> list[tuple[Fault, set[int]]]:
    """Return the faults that what disagrees suggests, each with the places in `CHECKS` of those that suspect it."""
    suspects: dict[tuple[object, ...], tuple[Fault, set[int]]] = {}
    for k, outcome in ((k, o) for k, some in enumerate(answers) for o in some if o.state == "disagree"):
        for fault in outcome.suspects:
            taken_for = fault.name.partition(" taken for ")[2].partition(",")[0]
            if taken_for and units.get(fault.channels[0], taken_for) != taken_for:
                continue
            held, by = suspects.get(fault.key, (fault, set()))
            # two checks may estimate one fault: the surer estimate is tried
            suspects[fault.key] = (fault if fault.std < held.std else held, by | {k})
    return list(suspects.values())


def _tried(log: Log, fault: Fault, by: set[int], answers: list[list[Outcome]]) -> _Trial | None:
    corrected = fault.corrected(log)
    if corrected is log:
        return None
    after = _asked_again(corrected, fault, by, answers)
    if after is None:
        return None
    now, wrong = _by_name(after), _wrong(answers)
    corrects = frozenset(name for name in wrong if name not in now or now[name].state != "disagree")
    # a check that is only silenced is not corrected, unless it has gone with the channels it compared
    if not any(name in now and now[name].consistent for name in corrects) and fault.kind not in _REMOVES:
        return None
    return _Trial(fault, corrects, after)


def _touched(fault: Fault) -> set[str]:
    return set(fault.channels) | (set(VELOCITIES["earth"] + VELOCITIES["body"]) if fault.kind == "frame" else set())


def _asked_again(
    corrected: Log, fault: Fault, by: set[int], answers: list[list[Outcome]]
) -> list[list[Outcome]] | None:
    """Return the answers after a correction; None as soon as a check newly disagrees, or where it corrects nothing."""
    touched, after = _touched(fault), [list(some) for some in answers]
    # those checks first that suspect it: most corrections fail there
    for n, k in enumerate(sorted(range(len(CHECKS)), key=lambda k: (k not in by, k))):
        if n == len(by) and not any(_fewer(answers[j], after[j]) for j in by):
            return None
        if not any(touched & set(o.channels) for o in answers[k]) and fault.kind != "frame":
            continue
        after[k] = CHECKS[k](corrected)
        before = {o.check: o.state for o in answers[k]}
        if any(o.state == "disagree" and before.get(o.check) != "disagree" for o in after[k]):
            return None
        if (
            fault.kind not in _REMOVES
            and not any(o.consistent for o in after[k])
            and any(o.state == "agree" for o in answers[k])
        ):
            return None  # it silenced what agreed
    return after


def _fewer(before: list[Outcome], after: list[Outcome]) -> bool:
    still = {o.check for o in after if o.state == "disagree"}
    return any(o.state == "disagree" and o.check not in still for o in before)

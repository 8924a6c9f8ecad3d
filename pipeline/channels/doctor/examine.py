"""The door of the doctor: every check on a log, and who is to blame for what disagrees."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from kempf.pipeline.channels.doctor import (
    heading_course,
    heading_rate,
    misalignment,
    rudder_order,
    rudder_turn,
    track,
    water_speed,
)
from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import VELOCITIES, Log
from kempf.pipeline.channels.doctor.outcome import Outcome

#: Every check: what it is called with, and the channels without which it says nothing.
CHECKS: tuple[Callable[[Log], list[Outcome]], ...] = (
    heading_rate.examine,
    heading_course.examine,
    misalignment.examine,
    track.examine,
    water_speed.examine,
    rudder_turn.examine,
    rudder_order.examine,
)
#: Lies that are taken back one after the other, at most.
_MOST_FAULTS = 4
#: A mend that leaves so much more over than the best one, over all checks together, is not as good.
_WORSE = 1.15


@dataclass(frozen=True)
class Finding:
    """One lie: what could be to blame for it, and what shows it.

    Attributes
    ----------
    faults : tuple of Fault
        One where a majority of the witnesses names it; several where it is one of these. Empty: nothing that the
        doctor knows explains it.
    evidence : tuple of Outcome
        The checks that disagree because of it, before it was mended.
    """

    faults: tuple[Fault, ...]
    evidence: tuple[Outcome, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that may be wrong, in the order of the faults; where none is known, all that disagree."""
        named = [c for fault in self.faults for c in fault.channels]
        return tuple(dict.fromkeys(named or [c for outcome in self.evidence for c in outcome.channels]))


@dataclass(frozen=True)
class Examination:
    """What the doctor found.

    Attributes
    ----------
    findings : tuple of Finding
    outcomes : tuple of Outcome
        Of every check on the log as it came.
    untested : tuple of str
        Channels that no check could test, by name.
    """

    findings: tuple[Finding, ...]
    outcomes: tuple[Outcome, ...]
    untested: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """``clean``, ``faults`` or ``untested``: nothing could be tested."""
        if self.findings:
            return "faults"
        return "clean" if any(o.state == "agree" for o in self.outcomes) else "untested"


def ask(log: Log) -> list[list[Outcome]]:
    """Run every check on a log; the outcomes of each, in the order of `CHECKS`."""
    return [check(log) for check in CHECKS]


def examine(log: Log) -> Examination:
    """Examine a log.

    What disagrees is explained by the lie whose taking back makes most checks agree and none disagree that did agree
    before; lies that do so equally well are all named. What still disagrees is explained in the same way.

    Parameters
    ----------
    log : Log

    Returns
    -------
    Examination

    References
    ----------
    Reiter (1987), "A theory of diagnosis from first principles", Artificial Intelligence 32: a diagnosis is a smallest
    set of components whose being faulty is consistent with everything that was observed.
    """
    first = answers = ask(log)
    came = log
    findings: list[Finding] = []
    for _ in range(_MOST_FAULTS):
        explained = _explained(log, answers)
        if explained is None:
            break
        faults, mended, answers_then = explained
        before = _by_name(answers)
        findings.append(Finding(faults, tuple(before[name] for name in mended)))
        log, answers = faults[0].mended(log), answers_then
    left = tuple(_wrong(answers).values())
    if left:
        findings.append(Finding((), left))
    outcomes = tuple(_by_name(first).values())
    tested = {c for o in outcomes if o.state != "untestable" for c in o.channels}
    return Examination(tuple(findings), outcomes, tuple(sorted(set(came.series) - tested)))


def _by_name(answers: list[list[Outcome]]) -> dict[str, Outcome]:
    return {outcome.check: outcome for some in answers for outcome in some}


def _wrong(answers: list[list[Outcome]]) -> dict[str, Outcome]:
    return {name: outcome for name, outcome in _by_name(answers).items() if outcome.state == "disagree"}


@dataclass(frozen=True)
class _Trial:
    """What a mend does: checks it makes agree, and the answers behind it."""

    fault: Fault
    mends: frozenset[str]
    after: list[list[Outcome]]

    @property
    def tested(self) -> dict[str, float]:
        """What each check that could be made leaves over behind the mend."""
        return {name: o.left_over for name, o in _by_name(self.after).items() if o.state != "untestable"}


def _explained(
    log: Log, answers: list[list[Outcome]]
) -> tuple[tuple[Fault, ...], tuple[str, ...], list[list[Outcome]]] | None:
    """Return the faults that explain most, the names of what they explain, and the answers behind the first mend."""
    suspects = _suspects(answers, log.units)
    trials = [trial for fault, by in suspects if (trial := _tried(log, fault, by, answers)) is not None]
    if not trials:
        return None
    most = max(trials, key=lambda t: (len(t.mends), -t.fault.simplicity))
    rivals = [t for t in trials if t.mends == most.mends]
    # over the checks that all of them can be held against
    shared = set.intersection(*(set(t.tested) for t in rivals))
    left = {t.fault.key: sum(t.tested[n] for n in sorted(shared)) / max(len(shared), 1) for t in rivals}
    rivals = [t for t in rivals if left[t.fault.key] <= _WORSE * min(left.values()) + 0.005]
    # of one channel's explanations the simplest; of equally simple ones that which fits best
    best: dict[tuple[str, ...], _Trial] = {}
    for trial in sorted(rivals, key=lambda t: (t.fault.simplicity, left[t.fault.key])):
        best.setdefault(trial.fault.channels, trial)
    chosen = sorted(best.values(), key=lambda t: (t.fault.simplicity, left[t.fault.key]))
    kept = [t for t in chosen if t.fault.simplicity <= max(chosen[0].fault.simplicity, 2)]
    return tuple(t.fault for t in kept), tuple(sorted(kept[0].mends)), kept[0].after


def _suspects(answers: list[list[Outcome]], units: Mapping[str, str]) -> list[tuple[Fault, set[int]]]:
    """Return the faults that what disagrees suggests, each with the places in `CHECKS` of those that suspect it."""
    found: dict[tuple[object, ...], tuple[Fault, set[int]]] = {}
    for k, outcome in ((k, o) for k, some in enumerate(answers) for o in some if o.state == "disagree"):
        for fault in outcome.suspects:
            taken_for = fault.name.partition(" taken for ")[2].partition(",")[0]
            if taken_for and units.get(fault.channels[0], taken_for) != taken_for:
                continue
            held, by = found.get(fault.key, (fault, set()))
            # two checks may estimate one fault: the surer estimate is tried
            found[fault.key] = (fault if fault.std < held.std else held, by | {k})
    return list(found.values())


def _tried(log: Log, fault: Fault, by: set[int], answers: list[list[Outcome]]) -> _Trial | None:
    mended = fault.mended(log)
    if mended is log:
        return None
    after = _asked_again(mended, fault, by, answers)
    if after is None:
        return None
    now, wrong = _by_name(after), _wrong(answers)
    mends = frozenset(name for name in wrong if name not in now or now[name].state != "disagree")
    # a check that is only silenced is not mended, unless it has gone with the channels it compared
    if not any(name in now and now[name].state == "agree" for name in mends) and fault.kind != "frame":
        return None
    return _Trial(fault, mends, after)


def _touched(fault: Fault) -> set[str]:
    return set(fault.channels) | (set(VELOCITIES["earth"] + VELOCITIES["body"]) if fault.kind == "frame" else set())


def _asked_again(mended: Log, fault: Fault, by: set[int], answers: list[list[Outcome]]) -> list[list[Outcome]] | None:
    """Return the answers behind a mend; None as soon as a check disagrees that did not before, or it mends nothing."""
    touched, after = _touched(fault), [list(some) for some in answers]
    # those checks first that suspect it: most mends fail there
    for n, k in enumerate(sorted(range(len(CHECKS)), key=lambda k: (k not in by, k))):
        if n == len(by) and not any(_fewer(answers[j], after[j]) for j in by):
            return None
        if not any(touched & set(o.channels) for o in answers[k]) and fault.kind != "frame":
            continue
        after[k] = CHECKS[k](mended)
        before = {o.check: o.state for o in answers[k]}
        if any(o.state == "disagree" and before.get(o.check) != "disagree" for o in after[k]):
            return None
        if (
            fault.kind != "frame"
            and not any(o.state == "agree" for o in after[k])
            and any(o.state == "agree" for o in answers[k])
        ):
            return None  # it silenced what agreed
    return after


def _fewer(before: list[Outcome], after: list[Outcome]) -> bool:
    still = {o.check for o in after if o.state == "disagree"}
    return any(o.state == "disagree" and o.check not in still for o in before)

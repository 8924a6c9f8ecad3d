"""Runs damaged inputs through a reader until the time is up, and keeps those that did something new or wrong."""

from __future__ import annotations

import gc
import resource
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from time import process_time

from benchmarks.ingest.fuzzing.corpus import Reader, inputs, packed
from benchmarks.ingest.fuzzing.mutate import Mutator
from benchmarks.ingest.fuzzing.oracles import Oracle, Outcome, oracle_of
from benchmarks.ingest.fuzzing.words import WORDS

#: Longest that a reader may take over one input, s: the least of three tries.
HANG_S = 1.0
#: Most that one input may add to the memory of the process, bytes.
MEMORY = 512 << 20
#: Inputs that did something new are damaged further; so many at most.
_POOL = 2_000


@dataclass(frozen=True)
class Finding:
    """One input that did something wrong."""

    what: str
    name: str
    data: bytes


@dataclass
class Campaign:
    """What came of it."""

    reader: Reader
    seed: int
    iterations: int = 0
    seconds: float = 0.0
    #: the input that took longest, s, and its size, bytes
    slowest: tuple[float, int] = (0.0, 0)
    #: what the process grew by at most, bytes
    grown: int = 0
    outcomes: dict[Outcome, int] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    @property
    def refused(self) -> int:
        """Inputs that ended in an error that a person can read."""
        return sum(count for outcome, count in self.outcomes.items() if outcome[0] == "refused")


def run(
    reader: Reader,
    seed: int,
    *,
    seconds: float = float("inf"),
    iterations: int | None = None,
    before: Callable[[str, bytes], None] | None = None,
) -> Campaign:
    """Fuzz one reader.

    Parameters
    ----------
    seed : int
        Of every choice; the same iterations of the same code give the same inputs.
    seconds : float
        Of the processor, so that a busy machine gets as much done.
    iterations : int, optional
        Whichever ends first.
    before : callable, optional
        Called with every input before it is read, so that one that kills the process is known.
    """
    mutator, found = Mutator(reader, WORDS[reader], seed), Campaign(reader, seed)
    judge, folder = oracle_of(reader)
    with folder:
        pool = inputs(reader)
        for name, data in [*pool, *([] if reader == "profile" else packed(*pool[0]))]:
            assert judge(name, data)[0] != "refused", f"{name} is no valid input"
        begin, floor = process_time(), _peak()
        while process_time() - begin < seconds and (iterations is None or found.iterations < iterations):
            name, data = mutator.next(pool)
            if before is not None:
                before(name, data)
            outcome = _one(judge, name, data, found)
            found.iterations += 1
            found.grown = max(found.grown, _peak() - floor)
            if _peak() - floor > MEMORY:
                found.findings.append(Finding(f"memory grew by {(_peak() - floor) >> 20} MB", name, data))
                floor = _peak()
            if outcome not in found.outcomes and len(pool) < _POOL and outcome[0] not in ("refused", "wrong"):
                pool.append((name, data))
            found.outcomes[outcome] = found.outcomes.get(outcome, 0) + 1
        found.seconds = process_time() - begin
    return found


def _one(judge: Oracle, name: str, data: bytes, found: Campaign) -> Outcome:
    took = float("inf")
    outcome: Outcome = ()
    for _ in range(3):
        try:
            outcome = judge(name, data)
        except Exception as error:  # noqa: BLE001 - whatever comes out is what is looked for
            last = traceback.extract_tb(error.__traceback__)[-1]
            what = f"{type(error).__name__}: {str(error)[:200]} in {last.name}"
            found.findings.append(Finding(what, name, data))
            return ("wrong", what)
        took = min(took, judge.took)
        if took <= HANG_S:
            break
        gc.collect()
    if took > HANG_S:
        found.findings.append(Finding(f"took {took:.1f} s", name, data))
    if took > found.slowest[0]:
        found.slowest = took, len(data)
    return outcome


def _peak() -> int:
    """Return the most memory that the process has held, bytes (Linux counts it in KiB)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

"""Sixteen trial logs of eight ships: ledgers that close, the zigzags that were sailed, executes, parameters."""

from __future__ import annotations

from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from tests.real_data.voyage import SHARED, Voyage
from tests.segment.loading import load
from tests.segment.test_measured import independent_start

USUAL = [("zigzag", 20.0, 20.0, "starboard", 7), ("zigzag", 10.0, 10.0, "port", 6)]
#: She loses her way after the first manoeuvre, and no steady course follows from which another could start.
EKATERINA = USUAL[:1]


def test_all_logs_are_in_and_their_ledgers_close(fleet: list[Voyage]) -> None:
    outcomes = {(v.ship.name, name): o for v in fleet for name, o in v.outcomes.items()}
    assert len(outcomes) == 16
    for log, outcome in outcomes.items():
        tally = outcome.tally
        assert outcome.outcome == "new", log
        assert tally is not None
        assert tally.records_read == tally.records_kept + tally.records_rejected, log
        assert tally.values_read == tally.values_kept + tally.values_rejected, log
        assert tally.values_kept > 50_000, log
        stated = sum(tally.by_reason.values())
        assert max(tally.records_rejected, tally.values_rejected) <= stated, log
        assert stated <= tally.records_rejected + tally.values_rejected, log


def test_damaged_sentences_are_counted(fleet: list[Voyage]) -> None:
    """About one line in 500 is damaged, says who wrote the logs."""
    nmea = [o.tally for v in fleet for name, o in v.outcomes.items() if ".nmea" in name]
    assert len(nmea) == 5
    for tally in nmea:
        assert tally is not None
        assert 1 / 1000 < tally.records_rejected / tally.records_read < 1 / 300
        assert tally.by_reason["checksum"] > 0


def test_the_zigzags_that_were_sailed_and_nothing_else(fleet: list[Voyage]) -> None:
    for voyage in fleet:
        for name, outcome in voyage.outcomes.items():
            ordered = sorted(outcome.segments, key=lambda s: s.start_utc_ns)
            zigzags = [(s.kind, s.psi0_deg, s.delta0_deg, s.first_side, len(s.executes_utc_ns)) for s in ordered]
            assert zigzags == (EKATERINA if voyage.ship.name == "ekaterina" else USUAL), (voyage.ship.name, name)


def test_executes_against_an_independent_estimate(fleet: list[Voyage]) -> None:
    """Other readers, another way to tell when the rudder starts to move; a second is what a zigzag can bear."""
    for voyage in fleet:
        for path in voyage.ship.logs:
            log = load(str(path.relative_to(SHARED)))
            executes = [ns for s in voyage.outcomes[path.name].segments for ns in s.executes_utc_ns]
            assert max(abs(independent_start(log, ns)) for ns in executes) < 1.0, path.name


def test_no_identification_fails_without_saying_why(fleet: list[Voyage]) -> None:
    """One healthy ship and the one that loses her way; the others are in the benchmark."""
    for voyage in (v for v in fleet if v.ship.name in ("aurora", "ekaterina")):
        for outcome in identify_vessel(voyage.warehouse, voyage.ship.name):
            made = outcome.parameter_set
            if made is None:
                assert outcome.error is not None
                assert outcome.error.message
                continue
            if voyage.ship.name == "aurora":
                assert made.convergence["converged"]
            if not made.convergence["converged"]:
                assert made.convergence["reason"]
                assert any(warning.startswith("not converged") for warning in made.warnings)


def test_a_set_is_rebuilt_bit_for_bit(fleet: list[Voyage]) -> None:
    voyage = next(v for v in fleet if v.ship.name == "halcyon")
    first = identify_vessel(voyage.warehouse, voyage.ship.name)[0]
    assert first.parameter_set is not None
    assert rerun(voyage.warehouse, first.parameter_set.parameter_set_id).verdict == "bit-identical"

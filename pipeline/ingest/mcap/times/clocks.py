"""The times of an MCAP log's messages, put right as far as the log shows that they are wrong.

First the recorder's clock, which may have been set on the way; then how evenly messages reached the recorder; then the
clocks behind the stamps, where the profile takes the time from these.
"""

from __future__ import annotations

from kempf.pipeline.ingest.decoded import NO_TIME, Nanoseconds
from kempf.pipeline.ingest.mcap.times.arrivals import Arrivals
from kempf.pipeline.ingest.mcap.times.clock_steps import without_steps
from kempf.pipeline.ingest.mcap.times.corrected import Corrected
from kempf.pipeline.ingest.mcap.times.delivery import bursts, by_stamps
from kempf.pipeline.ingest.mcap.times.stamp_clocks import one_clock


def put_right(topics: list[Arrivals], *, stamps_count: bool) -> Corrected:
    """Return the times that messages should have.

    Parameters
    ----------
    topics : list of Arrivals
    stamps_count : bool
        Whether the profile takes the time from the stamps; messages without have log time.

    Returns
    -------
    Corrected
        Nothing for a log whose times agree with each other.
    """
    stepped = without_steps(topics)
    log, notes = stepped.log_ns, list(stepped.notes)
    times: dict[str, Nanoseconds] = {}
    waited = [Arrivals(t.source, t.record, log[t.source], t.stamp_ns, t.value) for t in topics]
    if not stamps_count:
        late = by_stamps(waited)
        times |= late.times_ns
        notes += late.notes
    by_log = [t for t in waited if t.source not in times and not (stamps_count and (t.stamp_ns != NO_TIME).any())]
    together = bursts(by_log, log)
    log = log | together.times_ns
    times |= together.times_ns
    notes += together.notes
    if stepped.moved:
        times = ({t.source: log[t.source] for t in by_log} if stamps_count else log) | times
    if stamps_count:
        clocks = one_clock(waited, log)
        times |= clocks.times_ns
        notes += clocks.notes
    return Corrected(times, tuple(notes), together.std_s)

"""Whether `benchmarks.fleet.kill_torn` kills every command that writes, and finds what is not as it should be."""

from __future__ import annotations

import click

from benchmarks.fleet import kill_torn
from benchmarks.fleet.torn_jobs import JOBS, OF_THEIR_OWN, command_of
from kempf.workbench.cli.entry import cli

#: What reads a warehouse, or none, and stores nothing.
READERS = {
    *("doctor", "segments", "segments corrections", "params list", "params show", "params diff", "params export"),
    *("params steering", "history", "predict", "steer", "compare", "explain", "what-if", "next-trial"),
    "ladder",
    *("effects list", "effects show", "effects try", "verify", "vessels list", "vessels show", "profile draft"),
    *("export control", "export yaml", "export csv", "export mat", "export mcap", "export tables"),
    *("logs list", "logs show", "logs rejected", "logs quarantine", "config", "completion"),
}
#: What others do, each in a process that its own tests kill.
BY_OTHERS = {"workbench"}


def commands(group: click.Group, *before: str) -> set[str]:
    found = set()
    with click.Context(group) as context:
        for name in group.list_commands(context):
            inner = group.get_command(context, name)
            if isinstance(inner, click.Group):
                found |= commands(inner, *before, name)
                found |= {" ".join((*before, name))} if inner.invoke_without_command else set()
            else:
                found.add(" ".join((*before, name)))
    return found


def test_every_command_that_writes_is_killed():
    killed = {command_of(job) for job in JOBS}
    assert killed.isdisjoint(READERS)
    assert killed | READERS | BY_OTHERS | set(OF_THEIR_OWN) == commands(cli)


def test_two_hundred_kills_leave_no_job_out():
    shared = {place: kill_torn.shares(kills, place) for place, kills in kill_torn.KILLS.items()}
    assert sum(sum(jobs.values()) for jobs in shared.values()) == 200
    assert all(many > 0 for jobs in shared.values() for many in jobs.values())
    assert {name for jobs in shared.values() for name in jobs} == set(JOBS)

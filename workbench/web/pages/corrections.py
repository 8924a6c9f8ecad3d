"""What a person says of a manoeuvre, between the forms of the pages and the jobs that carry it out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.schemas.instants import iso_utc


def as_asked(arguments: Mapping[str, Any]) -> dict[str, str]:
    """Return the fields of the form that gives a job these arguments."""
    begin, end = (iso_utc(t) for t in arguments["bounds_utc_ns"]) if arguments["bounds_utc_ns"] else ("", "")
    fields = {name: str(arguments[name]) for name in ("action", "segment", "log", "reason")}
    return {**fields, "from": begin, "to": end}


def undoing(planned: Mapping[str, Any]) -> dict[str, str]:
    """Return the fields of the form that takes a correction back; what was said stays in the table of corrections.

    Parameters
    ----------
    planned : mapping
        JSON content of a correction that was carried out.
    """
    before, after = planned["before"], planned["after"]
    fields = {"segment": after["segment_id"], "log": "", "from": "", "to": "", "reason": f"undone: {planned['reason']}"}
    if before is None or before["excluded"]:  # it was not there, or did not count
        return {**fields, "action": "exclude"}
    correction = before["detail"].get("by_hand")
    if correction is not None and correction["action"] == "correct":
        return {**fields, "action": "correct", "from": before["start"], "to": before["end"]}
    return {**fields, "action": "accept"}

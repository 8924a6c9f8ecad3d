"""What did not work, in words; where a job is the next step, its button stands there."""

from __future__ import annotations

from typing import NamedTuple

from kempf.schemas.errors import KempfError
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.pages.page import Page


class Offer(NamedTuple):
    """A job that would help."""

    kind: str
    words: str
    vessel: str


def gather(failure: KempfError, status: int) -> Page:
    """Return the page of an error."""
    offer = _offer(failure)
    above = ((offer.vessel, of_vessel(offer.vessel)),) if offer else ()
    return Page("error.html", "That did not work", {"error": failure, "status": status, "offer": offer}, above)


def _offer(failure: KempfError) -> Offer | None:
    vessel, details = failure.details.get("vessel"), failure.details
    if failure.code == "no_parameter_set" and vessel is not None:
        return Offer("reprocess", "Bring up to date" if "withdrawn" in details else "Identify", vessel)
    if failure.code == "no_model" and vessel is not None:
        # a set of one manoeuvre is no model of several: to identify her again would make the same one
        return Offer("diagnose", "Diagnose", vessel) if details["current"] else Offer("reprocess", "Identify", vessel)
    return None

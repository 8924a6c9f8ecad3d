"""A parameter set: values with their errors, how they go together, what they were made from."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.chosen_set import named_set
from kempf.flows.jobs.out_of_date import said_of_sets
from kempf.warehouse import history
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.correlation import draw_correlation
from kempf.workbench.web.pages.page import Page


def document(desk: Desk, set_id: str) -> dict[str, Any]:
    """Return what `kempf params show ID --json` prints."""
    return named_set(desk.warehouse, set_id, None).show()


def gather(desk: Desk, set_id: str) -> Page:
    """Return the page of a parameter set."""
    one = named_set(desk.warehouse, set_id, None)
    content = {
        "one": one.show(),
        "groups": (
            ("Parameters", one.parameters),
            ("Noise and disturbances", one.noise),
            ("Discrete, eq. (17)", one.discrete),
        ),
        "converged": bool(one.convergence.get("converged")),
        "standing": one.parameter_set_id in set(history.standing(desk.warehouse, one.vessel)),
        "stale": said_of_sets(desk.warehouse, [one]),
        "correlation": draw_correlation(one.covariance_names, one.covariance),
    }
    return Page("parameter_set.html", one.parameter_set_id, content, ((one.vessel, of_vessel(one.vessel)),))

"""A parameter set: values with their errors, how they go together, what they were made from."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.identify.chosen_set import named_set
from kempf.flows.jobs.identify.leg_fit import by_name
from kempf.flows.jobs.state.out_of_date import said_of_sets
from kempf.warehouse.queries.standing import standing_ids
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.draw.correlation import draw_correlation
from kempf.workbench.web.pages.manoeuvre_names import names_of
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, set_id: str) -> dict[str, Any]:
    """Return what `kempf params show ID --json` prints."""
    return named_set(app_state.warehouse, set_id, None).as_json()


def gather(app_state: AppState, set_id: str) -> Page:
    """Return the page of a parameter set."""
    parameter_set = named_set(app_state.warehouse, set_id, None)
    unseen = parameter_set.unseen
    content = {
        "one": parameter_set.as_json(),
        "names": names_of(app_state.warehouse, parameter_set.vessel),
        "fitted": [name for name in parameter_set.segment_ids if name not in unseen],
        "held_out": list(parameter_set.convergence.get("held_out") or ()),
        "by_legs": by_name(parameter_set),
        "groups": (
            ("Parameters", parameter_set.parameters),
            ("Noise and disturbances", parameter_set.noise),
            ("Discrete, eq. (17)", parameter_set.discrete),
        ),
        "converged": bool(parameter_set.convergence.get("converged")),
        "standing": parameter_set.parameter_set_id in set(standing_ids(app_state.warehouse, parameter_set.vessel)),
        "stale": said_of_sets(app_state.warehouse, [parameter_set]),
        "correlation": draw_correlation(parameter_set.covariance_names, parameter_set.covariance),
    }
    return Page(
        "parameter_set.html",
        parameter_set.parameter_set_id,
        content,
        ((parameter_set.vessel, of_vessel(parameter_set.vessel)),),
    )

"""Runs laid out at the instants of measurement that their plain model finds (decision 0111).

A step of Gauss and Newton from a fit that takes unsure instants as they are is right for the hull, but not for what
asks how well the runs fit: misfit that instants leave is not the model's.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from kempf.flows.jobs.identify.vessel_runs import Layout, VesselRuns
from kempf.flows.process.cores import usable
from kempf.pipeline.diagnose.screening.staged import PlainStage, plain_stage
from kempf.pipeline.diagnose.screening.unsure_instants import with_instants
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas.errors import KempfError

#: twice the log-likelihood above which runs are laid out anew: of less no test of a model is aware; and how often
_SEEN, _MOST = 6.0, 3
#: rows as a share of the time in which a ship sails her length, from which they are too slow for her: what is between
#: them is then no matter of an instant
_SLOW = 0.25


@dataclass(frozen=True, eq=False)
class PlainRuns:
    """Runs with the plain model that was fitted to them."""

    runs: VesselRuns
    plain: PlainStage
    #: Whether the instants are those of the log, as they are taken there.
    as_taken: bool


def at_found_instants(layout: Layout, listener: Listener = SILENT) -> PlainRuns:
    """Fit the plain model, and anew as long as the instants that it finds change how well the runs fit.

    An instrument that is farther off than its rows allow is late itself, or the rudder is, and a diagnosis is to find
    it: then all instants stay as they are taken. They do so, too, of a log of which every manoeuvre is held out, and of
    a ship that is as quick as her rows.

    Parameters
    ----------
    layout : Layout
        Of the runs, with the instants as they are taken.
    listener : Listener, optional
        Notified of what is fitted.
    """
    with ThreadPoolExecutor(max_workers=usable()) as workers:

        def fitted(runs: VesselRuns, *, as_taken: bool) -> PlainRuns:
            chosen, _ = split(runs.runs)
            stage = plain_stage([runs.runs[i] for i in chosen], runs.spec, workers, listener=listener)
            return PlainRuns(runs, stage, as_taken)

        made = first = fitted(layout.runs(), as_taken=True)
        if any(_slow_beside(run) for run in first.runs.runs):
            return first
        for _ in range(_MOST):
            instants = with_instants(made.plain.fit, workers)
            if not instants.within_rows:
                return first
            if instants.gain < _SEEN:
                break
            try:
                again = layout.moved(instants.found).runs()
                if [run.name for run in again.runs] != [run.name for run in first.runs.runs]:
                    break
                made = fitted(again, as_taken=False)
            except KempfError:
                # a manoeuvre that can just be used stays where it can be
                break
        return made


def _slow_beside(run: GridRun) -> bool:
    """Return whether a ship is about as quick as the rows of her log."""
    return run.instant_errors.row_s * run.approach_m_s > _SLOW * run.ship.length_m

"""Runs laid out at the instants of measurement that their model finds (decision 0111).

A step of Gauss and Newton from a fit that takes unsure instants as they are is right for the hull, but not for what
asks how well the runs fit: misfit that instants leave is not the model's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field

from kempf.pipeline.channels.found_instants import FoundInstants
from kempf.pipeline.diagnose.screening.resolution import unresolved
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.diagnose.screening.unsure_instants import with_instants
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.plain_fit import PlainFit
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas.effect import Effect
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec

#: Lays all runs out anew with their logs moved to instants that were found, by number of the log.
LayOut = Callable[[Mapping[int, FoundInstants]], Sequence[GridRun]]

#: twice the log-likelihood above which runs are laid out anew: of less no test of a model is aware; and how often
_SEEN, _MOST = 6.0, 3


@dataclass(frozen=True, eq=False)
class FittedRuns:
    """Runs with a model that is fitted to those that are not held out."""

    runs: tuple[GridRun, ...]
    #: The plain ship.
    plain: PlainFit
    #: The plain model, then with one effect more after the other.
    fits: tuple[PooledFit, ...]
    #: By number of the log, what was found of its instants; empty where they are as they are taken.
    found: Mapping[int, FoundInstants] = field(default_factory=dict)


def at_found_instants(
    as_taken: FittedRuns, lay_out: LayOut, effects: Sequence[Effect], workers: Executor, listener: Listener = SILENT
) -> FittedRuns:
    """Lay runs out anew, and fit their model anew, as long as the instants that it finds change how well they fit.

    An instrument that is farther off than its rows allow is late itself, or the rudder is, and a diagnosis is to find
    it: then all instants stay as they are taken. They do so, too, of a log of which every manoeuvre is held out, of a
    ship that is too quick for her readings, and where a manoeuvre could not be used at the instants that are found.

    Parameters
    ----------
    as_taken : FittedRuns
        With the instants as they are taken.
    lay_out : callable
        Lays the runs out.
    effects : sequence of Effect
        Of the model.
    workers : Executor
        Runs share it.
    listener : Listener, optional
        Notified of what is fitted.
    """
    if unresolved(as_taken.runs) is not None:
        return as_taken
    made = as_taken
    for _ in range(_MOST):
        instants = with_instants(made.fits[-1], workers)
        if not instants.within_rows:
            return as_taken
        if instants.gain < _SEEN:
            return made
        try:
            runs = lay_out(instants.found)
            if [run.name for run in runs] != [run.name for run in as_taken.runs]:
                return made
            made = fitted_runs(runs, as_taken.fits[0].runs[0].spec, effects, workers, listener, instants.found)
        except KempfError:
            return made
    return made if with_instants(made.fits[-1], workers).within_rows else as_taken


def fitted_runs(
    runs: Sequence[GridRun],
    spec: ModelSpec,
    effects: Sequence[Effect],
    workers: Executor,
    listener: Listener = SILENT,
    found: Mapping[int, FoundInstants] | None = None,
) -> FittedRuns:
    """Fit a model to the runs that are not held out, effect by effect, see `kempf.pipeline.diagnose.screening.staged`.

    Parameters
    ----------
    spec : ModelSpec
        Disturbances.
    effects : sequence of Effect
        Of the model.
    workers : Executor
        Runs share it.
    listener : Listener, optional
        Notified of what is fitted.
    found : mapping of int to FoundInstants, optional
        At which the runs are laid out.
    """
    chosen, _ = split(runs)
    plain, fits = staged([runs[i] for i in chosen], spec, effects, workers, listener=listener)
    return FittedRuns(tuple(runs), plain, tuple(fits), found or {})

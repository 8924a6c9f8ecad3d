"""A warehouse for a notebook: logs go in, vessels come out."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from kempf.flows.process.configuration import configured_warehouse
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from kempf.workbench.notebook.frames import frame_of
from kempf.workbench.notebook.vessel_view import VesselView

_INGESTED = {
    **{"log": pl.String, "outcome": pl.String, "records_read": pl.Int64, "records_kept": pl.Int64},
    **{"records_rejected": pl.Int64, "manoeuvres": pl.Int64, "channels": pl.List(pl.String)},
    **{"notes": pl.List(pl.String), "error": pl.String},
}
_VESSELS = {"vessel": pl.String, "logs": pl.Int64, "segments": pl.Int64, "parameter_sets": pl.Int64}


def open_warehouse(uri: str | os.PathLike[str] | None = None) -> WarehouseView:
    """Open a warehouse; `kempf.open`. Nothing is read or made before it is asked for.

    Parameters
    ----------
    uri : str or path, optional
        A folder, or ``s3://bucket/prefix``; by default KEMPF_WAREHOUSE, else that of
        ``kempf.toml``, else ``kempf-data``.

    Raises
    ------
    UsageError
        ``warehouse_path``, ``configuration_invalid``.
    """
    address = configured_warehouse() if uri is None else uri
    return WarehouseView(Warehouse(os.fspath(address)))


@dataclass(frozen=True)
class WarehouseView:
    """A warehouse.

    Attributes
    ----------
    warehouse : Warehouse
    """

    warehouse: Warehouse

    def ingest(
        self,
        paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
        vessel: str | None = None,
        profile: str | os.PathLike[str] | None = None,
    ) -> pl.DataFrame:
        """Take raw logs in: each is read, checked, kept byte for byte and searched for manoeuvres.

        Parameters
        ----------
        paths : path or iterable of path
        vessel : str, optional
            Whose they are; else the profile says.
        profile : path, optional
            Vessel profile in YAML.

        Returns
        -------
        polars.DataFrame
            One row a log. ``channels`` says which of its channels contradict each other, ``error`` why it could not be
            read; such a log stops none of the others.

        Raises
        ------
        KempfError
            Where no log could be read, the error of the first.
        """
        from kempf.flows.jobs.ingest.files import read_profiles
        from kempf.flows.jobs.ingest.ingest_logs import ingest

        files = [paths] if isinstance(paths, str | os.PathLike) else list(paths)
        profiles = None if profile is None else read_profiles([Path(profile)])
        outcomes = ingest(self.warehouse, [Path(path) for path in files], vessel, profiles)
        failed = [outcome.error for outcome in outcomes if outcome.error is not None]
        if failed and len(failed) == len(outcomes):
            raise failed[0]
        rows = [
            {
                "log": Path(outcome.path).name,
                "outcome": outcome.outcome,
                **({} if outcome.tally is None else vars(outcome.tally)),
                "manoeuvres": len(outcome.segments),
                "channels": [] if outcome.examination is None else list(outcome.examination.findings),
                "notes": list(outcome.notes),
                "error": None if outcome.error is None else str(outcome.error),
            }
            for outcome in outcomes
        ]
        return frame_of(rows, _INGESTED)

    def vessels(self) -> pl.DataFrame:
        """Return the vessels with how many logs, manoeuvres to fit and parameter sets they have.

        Raises
        ------
        NotFound
            ``no_warehouse``.
        """
        from kempf.warehouse.queries.vessel_counts import vessel_counts

        return frame_of(vessel_counts(self.warehouse), _VESSELS)

    def vessel(self, name: str) -> VesselView:
        """Return one vessel.

        Raises
        ------
        NotFound
            ``no_warehouse``, ``no_vessel``.
        """
        vessels.require(self.warehouse, name)
        return VesselView(self.warehouse, name)

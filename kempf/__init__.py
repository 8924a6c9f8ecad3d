"""Raw ship sea-trial logs in, versioned manoeuvring models out.

`open` gives a warehouse, as docs/notebook.md shows. Nothing is imported before it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kempf.schemas.errors import DataRejected, KempfError, NotFound, UsageError
    from kempf.workbench.notebook.vessel_view import VesselView
    from kempf.workbench.notebook.warehouse_view import WarehouseView
    from kempf.workbench.notebook.warehouse_view import open_warehouse as open  # noqa: A004

    __version__: str

__all__ = ["DataRejected", "KempfError", "NotFound", "UsageError", "VesselView", "WarehouseView", "__version__", "open"]

_HOMES = {
    **dict.fromkeys(("DataRejected", "KempfError", "NotFound", "UsageError"), "schemas.errors"),
    "VesselView": "workbench.notebook.vessel_view",
    "WarehouseView": "workbench.notebook.warehouse_view",
    "open": "workbench.notebook.warehouse_view",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version(__name__)
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), {"open": "open_warehouse"}.get(name, name))


def __dir__() -> list[str]:
    return [*globals(), *__all__]

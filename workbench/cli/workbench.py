"""``kempf workbench``."""

from __future__ import annotations

import os
from pathlib import Path

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import warehouse_option


@click.command("workbench", cls=GivenOnce)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", default=8765, show_default=True, type=click.IntRange(0, 65535), help="0 takes a free one.")
@click.option(
    "--allow-host",
    "allowed",
    multiple=True,
    metavar="NAME",
    help="Name of this machine that others open the pages by; needed where --host is not the loopback.",
)
@click.option("--read-only", is_flag=True, help="Serve pages alone: nothing can be computed or changed.")
@click.option(
    "--state",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for jobs and predictions; deleting it costs time only. [default: in the user's cache]",
)
@click.option("--new", is_flag=True, help="Make the warehouse where there is none: logs are then sent from the page.")
@click.option("--open", "open_browser", is_flag=True, help="Open the browser.")
@warehouse_option
def command(
    host: str,
    port: int,
    allowed: tuple[str, ...],
    read_only: bool,
    state: Path | None,
    new: bool,
    open_browser: bool,
    uri: str,
) -> None:
    """Serve the warehouse as web pages: fleet, logs, manoeuvres, models, diagnoses and ladders.

    The address that it prints lets one browser compute and change; others that find the pages can read. Ctrl-C ends it.
    """
    from kempf.schemas.errors import UsageError
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.web.serve import listening, serve, with_token
    from kempf.workbench.web.settings import LOOPBACK, Settings

    warehouse = Warehouse(uri)
    if new and not read_only:
        warehouse.create()
    warehouse.require()
    if host not in (*LOOPBACK, "::1") and not allowed:
        raise UsageError(
            "allow_host_missing",
            f"On {host} others can open the pages, and no name is given that they may open them by.",
            "Give it with --allow-host NAME; behind another server, that one's name.",
            {"host": host},
        )
    bound = listening(Settings(host, port, allowed))
    settings = Settings(host, bound.getsockname()[1], allowed)
    if not read_only:
        settings = with_token(settings)
    shown = allowed[0] if allowed else host if ":" not in host else f"[{host.strip('[]')}]"
    address = f"http://{shown}:{settings.port}/"
    address += f"?token={settings.token}" if settings.token else ""
    click.echo(f"{warehouse.uri} at {address}  (Ctrl-C ends it)", err=True)
    if open_browser:
        click.launch(address)
    serve(warehouse, settings, state or _state_of(warehouse.uri), bound)


def _state_of(uri: str) -> Path:
    """Return the folder for a warehouse's jobs in the user's cache."""
    from kempf.warehouse.storage.canonical import sha256

    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    whole = uri if "://" in uri else str(Path(uri).resolve())
    return cache / "kempf" / "workbench" / sha256(whole)[:16]

"""``kempf purge``."""

from __future__ import annotations

import click

from kempf.schemas.enumeration import counted
from kempf.workbench.cli.confirm import confirm, reason_option, yes_option
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, warehouse_option
from kempf.workbench.terminal import one_line, print_json


@click.command("purge", cls=GivenOnce)
@click.argument("log_id")
@reason_option
@yes_option
@warehouse_option
@json_option
def command(log_id: str, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Delete a log for good: its bytes, every measurement in it, also in earlier versions. Nothing brings it back.

    What was concluded from it stays and counts no longer: its manoeuvres, parameter sets, diagnoses. The receipt is
    kept, and the log is not taken in again. For what was only a mistake there is `kempf logs remove`.
    """
    from kempf.flows.jobs.corrections.purge_logs import is_done, purge, what_goes
    from kempf.flows.jobs.state.out_of_date import command_for
    from kempf.warehouse.storage.store import Warehouse

    warehouse = Warehouse(uri)
    goes = what_goes(warehouse, log_id, reason)
    if is_done(warehouse, goes.log_id):
        if as_json:
            print_json(goes.as_json())
        else:
            click.echo(
                f"{one_line(goes.file_name)} of {goes.vessel!r} is deleted for good already ({one_line(goes.reason)}); "
                "nothing more was deleted"
            )
        return
    shown = (
        f"{one_line(goes.file_name)} of {goes.vessel!r} is deleted for good: {counted(goes.size_bytes, 'byte')}, "
        f"{counted(goes.readings, 'reading')}, {counted(goes.rejected, 'rejected record')}, and what was measured "
        f"in the reports of {goes.evidence} of her diagnoses"
    )
    confirm(shown, yes=yes)
    receipt = purge(warehouse, goes.log_id, reason)
    if as_json:
        print_json(receipt.as_json())
    else:
        click.echo(f"{shown}. Log {receipt.log_id}; next: {command_for([receipt.vessel])}")

"""``kempf explain``."""

from __future__ import annotations

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.instants import utc_ns_of
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_paragraph, print_table, progress_bar


@click.command("explain", cls=GivenOnce)
@vessel_option(required=True)
@click.option("--from", "start", required=True, metavar="TIME", help="Beginning of the stretch, ISO 8601.")
@click.option("--to", "end", required=True, metavar="TIME", help="Its end.")
@click.option("--set", "set_id", metavar="ID", help="Parameter set; default: the current one of the vessel.")
@click.option("--segment", "segment_id", metavar="ID", help="The manoeuvre, where several logs have these instants.")
@warehouse_option
@json_option
def command(
    vessel: str, start: str, end: str, set_id: str | None, segment_id: str | None, uri: str, as_json: bool
) -> None:
    """Rank the effects by what they would explain of one stretch of a manoeuvre, such as the worst one.

    `kempf compare --where` names the stretches where a model fails most. This ranks on those instants alone; whether an
    effect is there, `kempf diagnose` decides on all manoeuvres.
    """
    from kempf.flows.jobs.diagnose.explain_stretch import explain_stretch
    from kempf.warehouse.storage.store import Warehouse

    begin, over = utc_ns_of(start, "--from"), utc_ns_of(end, "--to")
    with progress_bar() as progress:
        document = explain_stretch(Warehouse(uri), vessel, begin, over, set_id, progress, segment_id).as_json()
    if as_json:
        print_json(document)
        return
    rows = []
    for effect in document["effects"]:
        if effect["score"] is not None:
            sizes = (
                f"{name} {number(s['value'])} ± {number(s['std'], 2)} {s['unit']}" for name, s in effect["size"].items()
            )
            share = effect["explained_of_misfit"]
            explained = None if share is None else 100.0 * share
            rows.append(
                [
                    effect["effect"],
                    number(effect["score"], 3),
                    number(effect["p_adjusted"], 2),
                    number(explained, 3),
                    ", ".join(sizes),
                ]
            )
    title = f"{document['segment_id']} of {vessel}, {document['from'][11:19]} to {document['to'][11:19]}"
    if rows:
        print_table(["effect", "score", "p, adjusted", "of the misfit, %", "size, ± 1 s.e."], rows[:12], title)
    for sentence in document["sentences"]:
        print_paragraph(sentence)

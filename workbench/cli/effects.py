"""``kempf effects list|show``; try, add and undo, which need a vessel, are beside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kempf.workbench.cli import effects_of_vessel
from kempf.workbench.cli.given_once import GivenOnceGroup
from kempf.workbench.cli.options import json_option
from kempf.workbench.terminal import print_json, print_table

if TYPE_CHECKING:
    from kempf.schemas.effect import Effect


@click.group("effects", cls=GivenOnceGroup)
def command() -> None:
    """Physical effects: list and show them, try one of your own, add one to a vessel's model."""


command.add_command(effects_of_vessel.try_formula)
command.add_command(effects_of_vessel.add)
command.add_command(effects_of_vessel.undo)


@command.command("list")
@click.option("--group", type=click.Choice(["hull", "rudder", "propulsion", "environment", "sensor", "other"]))
@click.option("--markdown", is_flag=True, help="Print the table of docs/effects.md.")
@json_option
def list_effects(group: str | None, markdown: bool, as_json: bool) -> None:
    """List the catalogue: what each effect is and which channels it needs."""
    from kempf.schemas.effects import catalogue
    from kempf.workbench.effects_table import effects_table

    chosen = [effect for effect in catalogue().values() if group in (None, effect.group)]
    if as_json:
        print_json([effect.as_json() for effect in chosen])
    elif markdown:
        click.echo(effects_table(chosen), nl=False)
    else:
        rows = [[e.name, e.group, ", ".join(e.needs) or "-", e.title] for e in chosen]
        print_table(["effect", "group", "needs", "what it is"], rows)


@command.command("show")
@click.argument("name", required=False)
@click.option("--symbols", is_flag=True, help="List what a formula of your own may contain.")
@json_option
def show(name: str | None, symbols: bool, as_json: bool) -> None:
    """Show an effect whole, or what a formula may contain."""
    from kempf.schemas.effects import get

    if name is None and not symbols:
        raise click.UsageError("Name an effect, or give --symbols.")
    effect = None if name is None else get(name)
    if as_json:
        shown = {} if effect is None else effect.as_json()
        print_json({**shown, **(_symbols() if symbols else {})})
        return
    if effect is not None:
        _print_effect(effect)
    if symbols:
        _print_symbols()


def _print_effect(effect: Effect) -> None:
    click.echo(click.style(f"{effect.name}: {effect.title}", bold=True))
    click.echo(f"  {effect.plain}")
    click.echo(f"  equation: {effect.equation}")
    click.echo(f"  needs: {', '.join(effect.needs) or 'no channel beyond those of every trial'}")
    if effect.measured_by:
        click.echo(f"  not looked for where the logs have: {', '.join(effect.measured_by)}")
    click.echo(f"  looks like: {effect.confounded_with}")
    click.echo(f"  distinguished by: {effect.separated_by}")
    click.echo(f"  reference: {effect.reference}")
    rows = [
        [p.name, p.unit, f"{p.low:g}", f"{p.high:g}", ", ".join(f"{step:g}" for step in p.steps), p.meaning]
        for p in effect.parameters
    ]
    print_table(["", "unit", "low", "high", "tried at", "meaning"], rows)


def _symbols() -> dict[str, Any]:
    from kempf.pipeline.model.terms.expression import FUNCTIONS
    from kempf.schemas.channels import CHANNELS
    from kempf.schemas.symbols import (
        CHANNEL_SYMBOLS,
        COMPUTED_SYMBOLS,
        RUN_SYMBOLS,
        SHIP_SYMBOLS,
        STATE_SYMBOLS,
        TARGETS,
    )

    channels = {s: f"{CHANNELS[c].words}, {CHANNELS[c].unit}; channel {c}" for s, c in CHANNEL_SYMBOLS.items()}
    return {
        "targets": {name: f"{words}, {unit}" for name, (unit, words) in TARGETS.items()},
        "symbols": {**STATE_SYMBOLS, **COMPUTED_SYMBOLS, **SHIP_SYMBOLS, **channels, **RUN_SYMBOLS},
        "functions": {name: count for name, (_, count) in FUNCTIONS.items()},
    }


def _print_symbols() -> None:
    vocabulary = _symbols()
    print_table(["acts on", "what it is"], list(vocabulary["targets"].items()), "Before the colon")
    print_table(["symbol", "what it is"], list(vocabulary["symbols"].items()), "After the colon")
    click.echo(f"  functions: {', '.join(vocabulary['functions'])}; operations: + - * / **")
    click.echo("  numbers to be estimated: c, c1 to c9, k, k1 to k9, tau, tau1 to tau9")

"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from kempf.flows.process.configuration import configured_warehouse

F = TypeVar("F", bound=Callable[..., Any])


def warehouse_option(function: F) -> F:
    """Add ``--warehouse``."""
    return click.option(
        "--warehouse",
        "uri",
        default=configured_warehouse,
        show_default="KEMPF_WAREHOUSE, else of kempf.toml, else ./kempf-data",
        metavar="URI",
        help="Where everything is kept: a folder or s3://bucket/prefix.",
    )(function)


def json_option(function: F) -> F:
    """Add ``--json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout.")(function)


def verbose_option(function: F) -> F:
    """Add ``--verbose``."""
    return click.option("--verbose", is_flag=True, help="Print every warning and note, not the gravest alone.")(
        function
    )


def vessel_option(*, required: bool = False, multiple: bool = False) -> Callable[[F], F]:
    """Add ``--vessel``: one name, or with ``multiple`` a tuple of them."""
    return click.option(
        "--vessel",
        "vessel",
        required=required,
        multiple=multiple,
        metavar="NAME",
        help="Name of the vessel." + (" May be repeated." if multiple else ""),
    )


def new_vessel_option(help_text: str) -> Callable[[F], F]:
    """Add ``--new-vessel``."""
    return click.option("--new-vessel", is_flag=True, help=help_text)


def set_argument(function: F) -> F:
    """Add the argument SET_ID, None where it is not given, and ``--vessel``, whose alias it is."""
    vessel = click.option("--vessel", metavar="NAME", help="Whose alias it is; needed where several vessels have it.")
    return click.argument("set_id", required=False)(vessel(function))


def profile_option(function: F) -> F:
    """Add ``--profile``, which may be repeated."""
    return click.option(
        "--profile",
        "profiles",
        multiple=True,
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Vessel profile in YAML or JSON; several are laid over each other and must not disagree.",
    )(function)


def output_option(help_text: str = "Write here instead of to stdout.", *, required: bool = False) -> Callable[[F], F]:
    """Add ``--output``, also called ``--out``: a file, or None."""
    return click.option(
        "--output",
        "--out",
        "output",
        type=click.Path(path_type=Path),
        required=required,
        metavar="FILE",
        help=help_text,
    )


def figure_option(purpose: str) -> Callable[[F], F]:
    """Add ``--figure``: a file that is not there yet, or None."""
    help_text = f"{purpose}: .png, .svg or .pdf."
    return click.option("--figure", type=click.Path(path_type=Path), metavar="FILE", help=help_text)


def folder_option(default: str, help_text: str) -> Callable[[F], F]:
    """Add ``--folder`` with its default."""
    return click.option(
        "--folder", type=click.Path(path_type=Path), default=Path(default), show_default=True, help=help_text
    )


def beginning_options(function: F) -> F:
    """Add ``--set``, ``--model`` and ``--effect-file``: what a diagnosis begins from, and what it tries too."""
    for option in (
        click.option("--effect-file", "files", multiple=True, type=click.Path(path_type=Path), metavar="FILE",
                     help="An effect of your own, YAML; tried beside the catalogue. May be repeated."),
        click.option("--model", type=click.Path(path_type=Path), metavar="FILE", help="Begin from this model, YAML."),
        click.option("--set", "set_id", metavar="ID", help="Begin from the model of this parameter set."),
    ):  # fmt: skip
        function = option(function)
    return function

"""The catalogue of effects as the Markdown table of docs/effects.md."""

from __future__ import annotations

from collections.abc import Iterable

from kempf.schemas.effect import Effect

_HEAD = "| effect | group | what it does | equation | needs |\n|---|---|---|---|---|\n"


def effects_table(effects: Iterable[Effect]) -> str:
    """Return one row an effect, in the order given."""
    rows = [
        f"| `{e.name}` | {e.group} | {e.plain} | `{_cell(e.equation)}` | {', '.join(e.needs) or '-'} |\n"
        for e in effects
    ]
    return _HEAD + "".join(rows)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")

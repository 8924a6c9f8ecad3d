"""The catalogue of physical effects, and each of them."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.identify.standing_model import current_effects
from kempf.schemas.effects import catalogue, get
from kempf.warehouse.tables import diagnoses
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.pages.page import Page


def list_document() -> list[dict[str, Any]]:
    """Return what `kempf effects list --json` prints."""
    return [effect.as_json() for effect in catalogue().values()]


def document(name: str) -> dict[str, Any]:
    """Return what `kempf effects show NAME --json` prints."""
    return get(name).as_json()


def gather_list() -> Page:
    """Return the page of the catalogue."""
    groups: dict[str, list[Any]] = {}
    for effect in catalogue().values():
        groups.setdefault(effect.group, []).append(effect)
    return Page("effects.html", "Effects", {"groups": groups})


def gather(app_state: AppState, name: str) -> Page:
    """Return the page of an effect."""
    effect = get(name)
    named = sorted(
        vessel for vessel, diagnosis in diagnoses.newest(app_state.warehouse).items() if name in diagnosis.effects
    )
    by_now = current_effects(app_state.warehouse)
    content = {
        "effect": effect,
        "lacking": [vessel for vessel in named if name not in by_now.get(vessel, ())],
        "having": [vessel for vessel, effects in by_now.items() if name in effects],
    }
    return Page("effect.html", effect.title, content, (("Effects", "/effects"),))

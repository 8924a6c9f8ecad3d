"""An effect as plain data, and the hash by which a model's provenance pins what was in it."""

from __future__ import annotations

import hashlib
import inspect
import json
import sys
from typing import Any

from kempf.pipeline.model.terms.effect import Effect


def as_json(effect: Effect) -> dict[str, Any]:
    """Return everything there is to an effect as JSON has it.

    Parameters
    ----------
    effect : Effect

    Returns
    -------
    dict
        Its fields; ``rudder_course`` says whether it changes the rudder's course; ``sha256`` is its `digest`.
    """
    return {
        **{key: getattr(effect, key) for key in ("name", "title", "group", "plain", "equation", "reference")},
        "parameters": [
            {**{key: getattr(p, key) for key in ("name", "unit", "low", "high", "meaning")}, "steps": list(p.steps)}
            for p in effect.parameters
        ],
        "terms": dict(effect.terms),
        "rudder_course": effect.rudder_course is not None,
        "states": [
            {"name": s.name, "derivative": s.derivative, "noise": s.noise, "initial_std": s.initial_std}
            for s in effect.states
        ],
        "needs": list(effect.needs),
        "told_by": list(effect.told_by),
        "confounded_with": effect.confounded_with,
        "separated_by": effect.separated_by,
        "sha256": digest(effect),
    }


def digest(effect: Effect) -> str:
    """Return the SHA-256 of what an effect computes: its terms, states and parameters, and the source of its course.

    The words about it are left out: a better sentence makes no other model.

    Parameters
    ----------
    effect : Effect
    """
    source = None
    if effect.rudder_course is not None:
        # the whole file: what the function calls is part of it
        source = inspect.getsource(sys.modules[effect.rudder_course.__module__])
    content = {
        "name": effect.name,
        "parameters": [[p.name, p.unit, p.low, p.high, list(p.steps)] for p in effect.parameters],
        "terms": sorted(effect.terms.items()),
        "states": [[s.name, s.derivative, s.noise, s.initial_std] for s in effect.states],
        "needs": list(effect.needs),
        "rudder_course": source,
    }
    if effect.told_by:
        content["told_by"] = list(effect.told_by)
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()

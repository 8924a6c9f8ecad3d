"""The summary of a fleet's diagnoses: which vessels lack which effect, since when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kempf.schemas.instants import iso_utc


def summary(diagnoses: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for every set of effects found, and one for every vessel without any.

    Parameters
    ----------
    diagnoses : sequence of mapping
        As `kempf.warehouse.tables.diagnoses.StoredDiagnosis.as_json` gives them, or ``{vessel, verdict, error}``.

    Returns
    -------
    list of dict
        ``vessel``, ``verdict``, ``effects`` (those that the data do not distinguish), ``since`` (ISO 8601, the first
        manoeuvre in which they are seen), ``held_out_before``, ``held_out_after`` (free-run errors), ``note``.
    """
    rows = []
    for diagnosis in diagnoses:
        ladder = diagnosis.get("ladder", [])
        ends = (ladder[0]["held_out_error"], ladder[-1]["held_out_error"]) if ladder else (None, None)
        verdict = {"vessel": diagnosis["vessel"], "verdict": diagnosis["verdict"]}
        error = {"held_out_before": ends[0], "held_out_after": ends[1]}
        note = diagnosis["error"]["message"] if "error" in diagnosis else ""
        for confusion_set in diagnosis.get("sets", []):
            since = confusion_set["since_utc_ns"]
            rows.append(
                {
                    **verdict,
                    "effects": " or ".join(confusion_set["effects"]),
                    "since": "" if since is None else iso_utc(since),
                    **error,
                    "note": note,
                }
            )
        if not diagnosis.get("sets"):
            rows.append({**verdict, "effects": "", "since": "", **error, "note": note})
    return rows

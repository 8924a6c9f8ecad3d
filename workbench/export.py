"""A parameter set as a file that other programs read."""

from __future__ import annotations

import csv
import io
import json

import yaml

from warehouse.parameter_set import ParameterSet


def as_text(one: ParameterSet, form: str) -> str:
    """Write a parameter set as YAML, CSV or JSON.

    Parameters
    ----------
    one : ParameterSet
    form : {"yaml", "csv", "json"}
        CSV holds the parameters alone: group, name, value, std, unit.
    """
    if form == "csv":
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["parameter_set_id", "group", "name", "value", "std", "unit"])
        for group in ("parameters", "discrete", "noise"):
            for p in getattr(one, group):
                writer.writerow([one.parameter_set_id, group, p.name, repr(p.value), repr(p.std), p.unit])
        return stream.getvalue()
    content = {key: value for key, value in one.show().items() if key != "iterations"}
    if form == "json":
        return json.dumps(content, indent=2) + "\n"
    return str(yaml.safe_dump(json.loads(json.dumps(content)), sort_keys=False, allow_unicode=True))

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.diagnose.hidden_effects.cases import Case, design
from benchmarks.diagnose.hidden_effects.write import write_case


@pytest.fixture(scope="session")
def sample() -> tuple[Case, ...]:
    return design(336, 1)


@pytest.fixture(scope="session")
def written(sample: tuple[Case, ...], tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Case, Path, Any]]:
    """Three cases as written, one a kind, on three hulls: with her folder and her answer."""
    root = tmp_path_factory.mktemp("hidden")
    found = []
    for kind, hull in (("none", "usv"), ("catalogue", "ferry"), ("outsider", "mariner")):
        case = next(c for c in sample if (c.kind, c.hull) == (kind, hull))
        write_case(case, root / "cases", root / "answers")
        answer = json.loads((root / "answers" / f"{case.case_id}.json").read_text(encoding="utf-8"))
        found.append((case, root / "cases" / case.case_id, answer))
    return found

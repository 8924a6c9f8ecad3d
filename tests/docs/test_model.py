"""docs/model.md is true: every model in it is valid, every key is given with its default, so are models beside it."""

from pathlib import Path

import pytest
import yaml

from kempf.flows.jobs.ingest.files import read_model
from kempf.schemas.model_spec import ModelSpec
from tests.docs.console import blocks

FOLDER = Path(__file__).parents[2] / "docs"
TEXT = (FOLDER / "model.md").read_text(encoding="utf-8")


def test_examples_are_valid_and_named(tmp_path: Path) -> None:
    found = []
    for _, _, lines in blocks(TEXT):
        path = tmp_path / "model.yaml"
        path.write_text("\n".join(lines), encoding="utf-8")
        found.append(read_model(path))
    assert [(m.name, m.wind, m.current) for m in found] == [("tank", "force", "none"), ("paper", "force", "lateral")]


def test_tank_example_is_the_file() -> None:
    shown = next(lines for _, _, lines in blocks(TEXT) if "name: tank" in lines)
    assert yaml.safe_load("\n".join(shown)) == yaml.safe_load((FOLDER / "models" / "tank.yaml").read_text("utf-8"))


def test_every_key_is_documented() -> None:
    for key in ModelSpec.model_fields:
        assert f"| `{key}` |" in TEXT, key


@pytest.mark.parametrize(("key", "documented"), [("name", "`plain`"), ("base", "`sway-yaw-16`"), ("wind", "`force`")])
def test_defaults_are_as_documented(key: str, documented: str) -> None:
    assert f"| `{key}` | {documented} |" in TEXT
    assert documented.strip("`") == getattr(ModelSpec(), key)


def test_rates_are_as_documented() -> None:
    assert ModelSpec().current == "earth"
    assert (ModelSpec().wind_correlation_rate_per_s, ModelSpec().current_correlation_rate_per_s) == (1e-5, 1e-6)

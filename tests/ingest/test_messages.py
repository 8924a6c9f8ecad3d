"""The JSON schemas of the logger's topics say the same as the profile that reads them."""

import json
from pathlib import Path

import yaml

from kempf.pipeline.ingest.messages.cdr_definition import types_of
from kempf.schemas.known_messages import TAKEN
from kempf.schemas.profile import parse

ROOT = Path(__file__).parents[2]


def test_every_field_of_every_message_is_mapped_with_its_unit():
    profile = parse(yaml.safe_load((ROOT / "docs/profiles/trial_logger.yaml").read_text()), "trial_logger.yaml")
    mapped = {key: channel.unit for key, channel in profile.source_for("a.mcap").channels.items()}
    stated = {}
    for path in (ROOT / "schemas" / "messages").glob("*.json"):
        message = json.loads(path.read_text())
        assert message["title"] == path.stem
        assert set(message["required"]) == set(message["properties"])
        for field, what in message["properties"].items():
            stated[f"{message['topic']}.{field}"] = what["unit"]
    assert stated == mapped


def test_the_same_messages_as_ros_definitions_are_read_without_a_profile():
    names = set()
    for path in (ROOT / "schemas" / "messages").glob("*.msg"):
        message = json.loads(path.with_suffix(".json").read_text())
        fields = types_of(f"kempf_msgs/msg/{path.stem}", path.read_text())[f"kempf_msgs/{path.stem}"]
        assert [(field.name, field.kind, field.count) for field in fields] == [
            (field, "float64", None) for field in message["properties"]
        ]
        taken = TAKEN[f"kempf_msgs/{path.stem}"]
        assert {field: one.unit for field, one in taken.items()} == {
            field: what["unit"] for field, what in message["properties"].items()
        }
        assert all(
            f"{what['unit']}; {what['description']}" in path.read_text() for what in message["properties"].values()
        )
        names.add(path.stem)
    assert names == {path.stem for path in (ROOT / "schemas" / "messages").glob("*.json")}
    assert {f"kempf_msgs/{name}" for name in names} == {name for name in TAKEN if name.startswith("kempf_msgs/")}

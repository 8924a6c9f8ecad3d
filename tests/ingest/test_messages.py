"""The JSON schemas of the logger's topics say the same as the profile that reads them."""

import json
from pathlib import Path

import yaml

from schemas.profile import parse

ROOT = Path(__file__).parents[2]


def test_every_field_of_every_message_is_mapped_with_its_unit():
    profile = parse(yaml.safe_load((ROOT / "docs/profiles/trial_logger.yaml").read_text()), "trial_logger.yaml")
    mapped = {key: channel.unit for key, channel in profile.source_for("a.mcap").channels.items()}
    told = {}
    for path in (ROOT / "schemas" / "messages").glob("*.json"):
        message = json.loads(path.read_text())
        assert message["title"] == path.stem
        assert set(message["required"]) == set(message["properties"])
        for field, what in message["properties"].items():
            told[f"{message['topic']}.{field}"] = what["unit"]
    assert told == mapped

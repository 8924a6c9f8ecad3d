"""Tables as versions of before layout 4 wrote them."""

from __future__ import annotations

import sys

import pytest

from kempf.warehouse.storage.keys import earlier_key, vessel_key


def write_earlier_keys(patched: pytest.MonkeyPatch) -> None:
    """Let everything write vessels under the keys of before, as long as the patch holds."""
    for module in [one for one in sys.modules.values() if vars(one).get("vessel_key") is vessel_key]:
        patched.setattr(module, "vessel_key", earlier_key)


def look(done: int, total: int, what: str) -> None:
    """Take notice of how far a migration is, as whoever waits for one does."""
    assert 0 <= done <= total and what

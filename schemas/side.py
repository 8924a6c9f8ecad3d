"""The sides of a ship."""

from __future__ import annotations

from typing import Literal

#: Of a turn or a rudder angle, the usual one first.
Side = Literal["starboard", "port"]

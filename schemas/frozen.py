"""What documents of a person have in common: no change, no unknown key, no infinite number."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Frozen(BaseModel):
    """Base of the documents that people write."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

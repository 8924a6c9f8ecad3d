"""What the standards of IMO resolution MSC.137(76) need to know of a ship; of a model, of the ship at full scale."""

from __future__ import annotations

from dataclasses import dataclass

from kempf.schemas.froude import at_full_scale
from kempf.schemas.profile import VesselProfile

#: The standards apply to ships of this length and more, and to chemical tankers and gas carriers of any length, m.
SHORTEST_SHIP_M = 100.0
#: The test speed is at least this share of the speed at 85 % of the engine's output.
SLOWEST_SHARE = 0.9
#: What is shorter may be a model, m.
_MODEL_M = 20.0


@dataclass(frozen=True)
class Particulars:
    """Those of a profile; lengths and speeds are those of what sails, a ship or her model."""

    #: Between perpendiculars.
    length_m: float | None = None
    #: At 85 % of the engine's output.
    trial_speed_m_s: float | None = None
    #: Length of the ship over that of the model that sails; None: she sails herself.
    model_scale: float | None = None

    @classmethod
    def of(cls, profile: VesselProfile) -> Particulars:
        """Return those of a profile."""
        return cls(profile.length_m, profile.trial_speed_m_s, profile.model_scale)

    @property
    def length_of_ship_m(self) -> float | None:
        """Length at full scale."""
        return None if self.length_m is None else at_full_scale(self.length_m, "m", self.model_scale or 1.0)

    @property
    def too_short(self) -> str:
        """Say that the standard does not apply to her; empty where it does, or where her length is not known."""
        length = self.length_of_ship_m
        if length is None or length >= SHORTEST_SHIP_M:
            return ""
        hint = "; of a model, give model_scale in the profile" if self.model_scale is None and length < _MODEL_M else ""
        return f"the ship is {length:.4g} m long, the standard begins at {SHORTEST_SHIP_M:g} m{hint}"

    def too_slow(self, speed_m_s: float) -> bool:
        """Return whether an approach is slower than the standard asks for."""
        return self.trial_speed_m_s is not None and speed_m_s < SLOWEST_SHARE * self.trial_speed_m_s

    def speed_of_ship(self, speed_m_s: float) -> float:
        """Return a speed at full scale, m/s."""
        return at_full_scale(speed_m_s, "m/s", self.model_scale or 1.0)

"""The vessel profile that reads a simulated trial's own logs, with the ship's particulars."""

from __future__ import annotations

from kempf.pipeline.simulate.logger_fields import LOGGER_FIELDS
from kempf.pipeline.simulate.trial import TrialSettings
from kempf.schemas.profile import Antenna, ChannelMap, Source, TimeColumn, VesselProfile


def logger_profile(settings: TrialSettings) -> VesselProfile:
    """Return the profile of the simulated ship; its sources fit `to_csv` and `to_mcap`, NMEA needs none.

    Parameters
    ----------
    settings : TrialSettings
        Of the trial; only instruments that she carries are mapped.
    """
    hull = settings.hull
    carried = {i.name for i in settings.instruments}
    fields = [f for f in LOGGER_FIELDS if f.instrument in carried]
    columns = {f.name: ChannelMap(channel=f.channel, unit=f.unit) for f in fields}
    topics = {f"{f.topic}.{f.name}": ChannelMap(channel=f.channel, unit=f.unit) for f in fields}
    return VesselProfile(
        vessel=hull.name,
        length_m=hull.length_m,
        beam_m=hull.beam_m,
        draught_m=hull.draught_m,
        block_coefficient=hull.block_coefficient,
        trial_speed_m_s=hull.trial_speed_m_s,
        wind_arm_per_m=hull.wind_arm_per_m,
        antenna=Antenna(forward_m=settings.antenna_forward_m, starboard_m=settings.antenna_starboard_m),
        sources=[
            Source(match="*.csv*", time=TimeColumn(column="utc"), channels=columns),
            Source(match="*.mcap", channels=topics),
        ],
    )

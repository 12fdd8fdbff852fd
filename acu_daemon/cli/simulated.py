"""What the simulator needs of a station's file."""

from acu_daemon.config.station_tables import StationFile
from acu_daemon.sim.build import StationAir


def station_air(station: StationFile) -> StationAir | None:
    """The air over the antenna; None: `refraction = false`, a vacuum."""
    section = station.atmosphere
    if section.refraction is False:
        return None
    return StationAir(section.air(station.site.station), section.has_refraction)

"""What the simulator needs of a station's file."""

from acu_daemon.config.station_tables import StationFile
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.air import Air


def station_air(station: StationFile) -> Air | None:
    """The weather that the daemon is told of; None: `refraction = false`, a vacuum."""
    section = station.atmosphere
    return section.air(station.site.station) if section.refraction else None


def tilt_of(station: StationFile) -> tuple[AxisLimits, float] | None:
    """The tilt that the simulated pedestal stands on, and towards which azimuth it leans."""
    section = station.acu.tilt
    return None if section is None else (section.limits(), section.towards_deg)

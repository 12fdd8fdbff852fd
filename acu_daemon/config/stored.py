"""Tables as text and back, so that a recording holds what its pass was decided with."""

from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.station_tables import StationFile

_NOT_OF_A_PASS = {
    "elements",
    "hooks",
    "schedule",
    "wind",
}  # they decide nothing within it, and may name what is private
_ELEMENTS = '{"kind":"tle","file":"recorded"}'  # the orbit itself is recorded, from wherever it came


def station_text(station: StationFile) -> str:
    """What of a station decides a pass, as JSON; numbers are exact."""
    return station.model_dump_json(exclude_unset=True, exclude=_NOT_OF_A_PASS)


def station_of(text: str) -> StationFile:
    """ValueError: it is none, and why."""
    return StationFile.model_validate_json(text)


def satellite_text(satellite: SatelliteFile) -> str:
    """What of a satellite's file decides a pass beside the orbit, as JSON."""
    kept = satellite.model_dump_json(exclude_unset=True, exclude={"elements", "schedule"})
    return f'{kept.removesuffix("}")},"elements":{_ELEMENTS}}}'


def satellite_of(text: str) -> SatelliteFile:
    """ValueError: it is none, and why."""
    return SatelliteFile.model_validate_json(text)

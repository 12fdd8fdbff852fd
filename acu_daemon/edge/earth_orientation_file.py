"""The Earth orientation of a date out of the file that [time] earth_orientation names: as old as it may be.

No network: whoever fetches finals2000A puts it there.  A file that is old, cut or gone costs no pass (UT1-UTC is up to
0.9 s, 0.03 deg at worst on a low orbit): what is known is used, and what it may cost is said.
"""

from dataclasses import dataclass
from pathlib import Path

from acu_daemon.config.station_tables import StationFile, TimeSection
from acu_daemon.edge.state_directory import refuse_world_writable
from acu_daemon.errors import EarthOrientationError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.earth_orientation import parse_earth_orientation

NO_VALUES = "UT1-UTC and the pole are taken as 0, up to 0.03 deg off: get a finals2000A or C04 file of the IERS"


@dataclass(frozen=True, slots=True)
class EarthUsed:
    """The orientation in force; about: of which age it is; warning: what it lacks, empty where nothing."""

    orientation: EarthOrientation
    about: str = ""
    warning: str = ""


def read_earth_orientation(path: Path, tai_s: float) -> EarthUsed:
    """Read the orientation of an instant.  UsageError: everybody may write the file."""
    refuse_world_writable(path)
    try:
        table = parse_earth_orientation(path.read_text(encoding="ascii", errors="replace"), path.name)
    except OSError as error:
        return EarthUsed(EarthOrientation(), warning=f"{path}: Earth orientation: {error.strerror}; {NO_VALUES}")
    except EarthOrientationError as error:
        return EarthUsed(EarthOrientation(), warning=f"{error}; {NO_VALUES}")
    return EarthUsed(table.at(tai_s), table.about(tai_s), table.warning(tai_s) or "")


def at_date(station: StationFile, config: Path, tai_s: float) -> tuple[StationFile, EarthUsed]:
    """Give the station with the Earth orientation of an instant typed in, if it names a file (beside station.toml)."""
    section = station.time
    if section.earth_orientation is None:
        return station, EarthUsed(section.orientation)
    used = read_earth_orientation(config / section.earth_orientation, tai_s)
    of_date = used.orientation
    typed = TimeSection(
        ut1_utc_s=of_date.ut1_utc_s,
        polar_motion_x_arcsec=of_date.polar_x_arcsec,
        polar_motion_y_arcsec=of_date.polar_y_arcsec,
    )
    return station.model_copy(update={"time": typed}), used

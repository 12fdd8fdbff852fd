"""One set of SGP4 mean elements as read from a file, and what was wrong with one that could not be read."""

from dataclasses import dataclass
from math import pi
from typing import Literal

from acu_daemon.units import DAY_S

SGP4_MU_M3_S2 = 3.986008e14  # WGS72, the constants element sets are made with (Spacetrack Report #3)
SGP4_EARTH_RADIUS_M = 6378135.0  # WGS72

ElementKind = Literal["tle", "omm"]


@dataclass(frozen=True, slots=True)
class ElementSet:
    """SGP4 mean elements (TEME of date) with where they were read: `line` or, in a list of records, `record`."""

    kind: ElementKind
    name: str  # empty where the file has none
    norad_id: int
    epoch_tai_s: float
    mean_motion_rad_s: float  # Kozai mean, as the file has it
    eccentricity: float
    inclination_rad: float
    raan_rad: float
    argp_rad: float
    mean_anomaly_rad: float
    bstar_per_radius: float
    file: str
    line: int | None = None
    record: int | None = None

    @property
    def label(self) -> str:
        """Name and catalogue number, for messages."""
        return f"{self.name} ({self.norad_id})" if self.name else f"NORAD {self.norad_id}"

    @property
    def where(self) -> str:
        """File and line (or record), for messages."""
        return place(self.file, self.line, self.record)

    @property
    def semi_major_axis_m(self) -> float:
        """From the mean motion by Kepler's third law."""
        return float((SGP4_MU_M3_S2 / self.mean_motion_rad_s**2) ** (1.0 / 3.0))


@dataclass(frozen=True, slots=True)
class Problem:
    """Why one set of a file was left out; or text that is none, or what to know of a set that was read all the same.

    norad_id, name: of the set, as far as they can be read.
    """

    file: str
    line: int | None
    reason: str
    record: int | None = None
    norad_ids: tuple[int, ...] = ()
    name: str = ""
    kind: Literal["lost", "text", "note"] = "lost"

    def __str__(self) -> str:
        return f"{place(self.file, self.line, self.record)}: {self.reason}"


def place(file: str, line: int | None, record: int | None) -> str:
    """Where in a file, for people."""
    if line is not None:
        return f"{file}, line {line}"
    return file if record is None else f"{file}, record {record}"


def rad_s_from_rev_day(rev_day: float) -> float:
    """Turn a mean motion in revolutions per day into rad/s."""
    return rev_day * 2.0 * pi / DAY_S

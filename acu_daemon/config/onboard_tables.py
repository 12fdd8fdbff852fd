"""PASS.toml of `acu-daemon onboard profile`: a pass of a satellite with a steerable antenna.

docs/onboard.md shows one.  Unknown keys and impossible values are refused with file, key, value and what was expected.
"""

from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from acu_daemon.config.load import parse, read_toml
from acu_daemon.config.satellite_tables import BrouwerSection, ElementsFileSection, SatelliteFile, SatelliteSection
from acu_daemon.config.section import Name, Positive, Section, UtcTime
from acu_daemon.config.station_tables import TimeSection
from acu_daemon.model import AxisLimits, Site, Station
from acu_daemon.onboard.attitude import Agility
from acu_daemon.onboard.checks import Backlash
from acu_daemon.onboard.cone import Cone

Angle = Annotated[float, Field(ge=-180, le=180)]
Offset = Annotated[float, Field(ge=-5, le=5)]


class GroundStation(Section):
    latitude_deg: float = Field(ge=-90, le=90)
    longitude_deg: float = Field(ge=-180, le=360)
    height_m: float = Field(default=0.0, ge=-500, le=9000)
    name: Name = "station"


class PassSection(Section):
    from_utc: UtcTime
    min_elevation_deg: float = Field(default=5.0, ge=0, lt=90)


class HoldRow(Section):
    """Angles kept for a time."""

    start_utc: UtcTime
    duration_s: Positive
    roll_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    yaw_deg: Angle = 0.0


class TargetRow(Section):
    """A place that the body points at in the middle of the hold, imaged."""

    start_utc: UtcTime
    duration_s: Positive
    latitude_deg: float = Field(ge=-90, le=90)
    longitude_deg: float = Field(ge=-180, le=360)
    height_m: float = Field(default=0.0, ge=-500, le=9000)


class ImagingRow(Section):
    start_utc: UtcTime
    duration_s: Positive


class AttitudeSection(Section):
    file: Name | None = None
    body_frame: Name | None = None
    hold: Sequence[HoldRow] = ()
    strip: Sequence[HoldRow] = ()
    target: Sequence[TargetRow] = ()
    imaging: Sequence[ImagingRow] = ()
    rate_deg_s: Positive = 1.0
    acceleration_deg_s2: Positive = 0.05
    settle_s: float = Field(default=5.0, ge=0, le=600)
    max_angle_deg: float = Field(default=30.0, gt=0, le=90)

    @model_validator(mode="after")
    def _one_source(self) -> "AttitudeSection":
        if self.file is not None and (self.hold or self.strip or self.target):
            raise ValueError("file and a list of holds, strips or targets: expected one of the two")
        if self.file is None and self.imaging:
            raise ValueError("imaging tells when the camera works for an attitude file; write strips or targets here")
        return self

    @property
    def agility(self) -> Agility:
        return Agility(self.rate_deg_s, self.acceleration_deg_s2, self.settle_s, self.max_angle_deg)


class GimbalAxis(Section):
    min_deg: float = Field(ge=-720, le=720)
    max_deg: float = Field(ge=-720, le=720)
    max_rate_deg_s: Positive | None = None
    max_acceleration_deg_s2: Positive | None = None

    @model_validator(mode="after")
    def _min_below_max(self) -> "GimbalAxis":
        self._must_be_below("min_deg", "max_deg")
        return self

    def limits(self) -> AxisLimits:
        rate, acceleration = self.max_rate_deg_s or inf, self.max_acceleration_deg_s2 or inf
        return AxisLimits(self.min_deg, self.max_deg, rate, acceleration)


class AzimuthAxis(GimbalAxis):
    min_deg: float = Field(default=-270.0, ge=-720, le=720)
    max_deg: float = Field(default=270.0, ge=-720, le=720)


class ElevationAxis(GimbalAxis):
    """From the gimbal's axis."""

    min_deg: float = Field(default=0.0, ge=-30, le=180)
    max_deg: float = Field(default=110.0, ge=-30, le=180)


class Misalignment(Section):
    roll_deg: Angle = 0.0
    pitch_deg: Angle = 0.0
    yaw_deg: Angle = 0.0

    @property
    def angles_deg(self) -> tuple[float, float, float]:
        return self.roll_deg, self.pitch_deg, self.yaw_deg


class BacklashSection(Section):
    azimuth_deg: float = Field(default=0.0, ge=0, le=1)
    elevation_deg: float = Field(default=0.0, ge=0, le=1)


class BoresightSection(Section):
    elevation_deg: Offset = 0.0
    cross_deg: Offset = 0.0


class AntennaSection(Section):
    margin_deg: float = Field(ge=0.001, le=30)
    azimuth: AzimuthAxis = AzimuthAxis()
    elevation: ElevationAxis = ElevationAxis()
    mount: Misalignment = Misalignment()
    bus: Misalignment = Misalignment()
    boresight: BoresightSection = BoresightSection()
    backlash: BacklashSection = BacklashSection()

    def cone(self, margin_deg: float | None = None) -> Cone:
        axis, boresight = self.elevation, self.boresight
        margin = self.margin_deg if margin_deg is None else margin_deg
        return Cone(margin, boresight.elevation_deg, boresight.cross_deg, axis.min_deg, axis.max_deg)

    @property
    def play(self) -> Backlash:
        return Backlash(self.backlash.azimuth_deg, self.backlash.elevation_deg)


class ProfileSection(Section):
    method: Literal["single", "three", "search", "free"] = "free"
    objective: Literal["peak", "imaging"] = "peak"


class PassFile(Section):
    satellite: SatelliteSection
    elements: Annotated[ElementsFileSection | BrouwerSection, Field(discriminator="kind")]
    station: GroundStation
    when: PassSection = Field(alias="pass")
    antenna: AntennaSection
    attitude: AttitudeSection = AttitudeSection()
    profile: ProfileSection = ProfileSection()
    time: TimeSection = TimeSection()

    @property
    def site(self) -> Site:
        s = self.station
        return Site(Station(s.name, s.latitude_deg, s.longitude_deg, s.height_m), self.time.orientation)

    @property
    def as_satellite(self) -> SatelliteFile:
        """What the reader of elements takes."""
        return SatelliteFile(satellite=self.satellite, elements=self.elements)


def read_pass(path: Path) -> PassFile:
    """Read a PASS.toml.  ConfigError: names file, key, value and what was expected."""
    values = read_toml(path, "[satellite], [elements], [station], [pass] and [antenna] of a pass")
    return parse(PassFile, path, values, also={path.name: PassFile})

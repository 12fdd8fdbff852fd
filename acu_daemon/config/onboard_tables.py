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
    latitude_deg: float = Field(
        ge=-90, le=90, description="Geodetic latitude (WGS84), north positive.  Decides where the antenna looks."
    )
    longitude_deg: float = Field(ge=-180, le=360, description="Longitude, east positive.  Decides the same.")
    height_m: float = Field(default=0.0, ge=-500, le=9000, description="Height over the ellipsoid.  Decides the same.")
    name: Name = Field(
        default="station", description="The station's name, for people.  Decides what pictures and files call it."
    )


class PassSection(Section):
    from_utc: UtcTime = Field(
        json_schema_extra={"range": "a time that ends in Z"},
        description="The pass in progress then, else the first one after.  Decides which pass is planned.",
    )
    min_elevation_deg: float = Field(
        default=5.0, ge=0, lt=90, description="The horizon of the station.  Decides when the pass begins and ends."
    )


class HoldRow(Section):
    """Angles kept for a time."""

    start_utc: UtcTime = Field(
        json_schema_extra={"range": "a time that ends in Z"},
        description="When it begins.  Decides when the body is there.",
    )
    duration_s: Positive = Field(description="How long it lasts.  Decides the same.")
    roll_deg: Angle = Field(default=0.0, description="Roll of the body against LVLH.  Decides where the body looks.")
    pitch_deg: Angle = Field(default=0.0, description="Pitch of the body against LVLH.  Decides where the body looks.")
    yaw_deg: Angle = Field(default=0.0, description="Yaw of the body against LVLH.  Decides where the body looks.")


class TargetRow(Section):
    """A place that the body points at in the middle of the hold, imaged."""

    start_utc: UtcTime = Field(
        json_schema_extra={"range": "a time that ends in Z"},
        description="When it begins.  Decides when the body is there.",
    )
    duration_s: Positive = Field(description="How long it lasts.  Decides the same.")
    latitude_deg: float = Field(
        ge=-90, le=90, description="Geodetic latitude of the place.  Decides where +Z points in the middle of the time."
    )
    longitude_deg: float = Field(ge=-180, le=360, description="Its longitude, east positive.  Decides the same.")
    height_m: float = Field(
        default=0.0, ge=-500, le=9000, description="Its height over the ellipsoid.  Decides the same."
    )


class ImagingRow(Section):
    start_utc: UtcTime = Field(
        json_schema_extra={"range": "a time that ends in Z"},
        description="When it begins.  Decides when the camera works, for an attitude file.",
    )
    duration_s: Positive = Field(description="How long it lasts.  Decides the same.")


class AttitudeSection(Section):
    file: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a path"},
        description=(
            "An attitude file (CCSDS AEM) beside this one; left out: holds, strips and targets.  Decides how the body "
            "turns."
        ),
    )
    body_frame: Name | None = Field(
        default=None,
        description=(
            "Its name of the body's frame; left out: SC_BODY or SC_BODY_n.  Decides which of its frames is the body."
        ),
    )
    hold: Sequence[HoldRow] = Field(default=(), description="Angles that are kept for a time.")
    strip: Sequence[HoldRow] = Field(default=(), description="The same, imaged.")
    target: Sequence[TargetRow] = Field(default=(), description="Places that the body points at, imaged.")
    imaging: Sequence[ImagingRow] = Field(default=(), description="When the camera works, for an attitude file.")
    rate_deg_s: Positive = Field(
        default=1.0, description="The fastest that the body turns.  Decides how long a slew takes."
    )
    acceleration_deg_s2: Positive = Field(default=0.05, description="How fast it gets there.  Decides the same.")
    settle_s: float = Field(
        default=5.0, ge=0, le=600, description="Rest between a slew and imaging.  Decides when a slew must be over."
    )
    max_angle_deg: float = Field(
        default=30.0, gt=0, le=90, description="The largest angle off nadir.  Decides which plans are refused."
    )

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
    min_deg: float = Field(ge=-720, le=720, description="Lower end of its range.  Decides where the profile may go.")
    max_deg: float = Field(ge=-720, le=720, description="Upper end of its range.  Decides the same.")
    max_rate_deg_s: Positive | None = Field(
        default=None,
        json_schema_extra={"range": "> 0"},
        description=(
            "The fastest that it turns; left out: no limit.  Decides what of a pass near the axis cannot be followed."
        ),
    )
    max_acceleration_deg_s2: Positive | None = Field(
        default=None,
        json_schema_extra={"range": "> 0"},
        description="How fast it gets there; left out: no limit.  Decides the same.",
    )

    @model_validator(mode="after")
    def _min_below_max(self) -> "GimbalAxis":
        self._must_be_below("min_deg", "max_deg")
        return self

    def limits(self) -> AxisLimits:
        rate, acceleration = self.max_rate_deg_s or inf, self.max_acceleration_deg_s2 or inf
        return AxisLimits(self.min_deg, self.max_deg, rate, acceleration)


class AzimuthAxis(GimbalAxis):
    min_deg: float = Field(
        default=-270.0, ge=-720, le=720, description="Lower end of its range.  Decides where the profile may go."
    )
    max_deg: float = Field(default=270.0, ge=-720, le=720, description="Upper end of its range.  Decides the same.")


class ElevationAxis(GimbalAxis):
    """From the gimbal's axis."""

    min_deg: float = Field(
        default=0.0, ge=-30, le=180, description="Lower end of its range.  Decides where the profile may go."
    )
    max_deg: float = Field(default=110.0, ge=-30, le=180, description="Upper end of its range.  Decides the same.")


class Misalignment(Section):
    roll_deg: Angle = Field(
        default=0.0,
        description=(
            "Roll, turned in the order roll, pitch, yaw as in docs/onboard.md.  Decides how the gimbal stands on the "
            "body."
        ),
    )
    pitch_deg: Angle = Field(
        default=0.0,
        description=(
            "Pitch, turned in the order roll, pitch, yaw as in docs/onboard.md.  Decides how the gimbal stands on the "
            "body."
        ),
    )
    yaw_deg: Angle = Field(
        default=0.0,
        description=(
            "Yaw, turned in the order roll, pitch, yaw as in docs/onboard.md.  Decides how the gimbal stands on the "
            "body."
        ),
    )

    @property
    def angles_deg(self) -> tuple[float, float, float]:
        return self.roll_deg, self.pitch_deg, self.yaw_deg


class BacklashSection(Section):
    azimuth_deg: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="Play of the azimuth from stop to stop.  Decides how far the profile leads the motion: half of it.",
    )
    elevation_deg: float = Field(default=0.0, ge=0, le=1, description="The same of the elevation.  Decides the same.")


class BoresightSection(Section):
    elevation_deg: Offset = Field(
        default=0.0,
        description=(
            "The boresight's offset away from the gimbal's axis.  Decides the angles that point the beam at the "
            "station."
        ),
    )
    cross_deg: Offset = Field(default=0.0, description="Its offset towards growing azimuth.  Decides the same.")


class AntennaSection(Section):
    margin_deg: float = Field(
        ge=0.001,
        le=30,
        description=(
            "Half cone around the station's direction, at the satellite, within which the link holds.  Decides how "
            "slowly the gimbal may move."
        ),
    )
    azimuth: AzimuthAxis = Field(default=AzimuthAxis(), description="Range and drive of the azimuth.")
    elevation: ElevationAxis = Field(
        default=ElevationAxis(), description="Range and drive of the elevation, from the gimbal's axis."
    )
    mount: Misalignment = Field(default=Misalignment(), description="How the gimbal stands on the bus.")
    bus: Misalignment = Field(default=Misalignment(), description="How the bus stands in the body.")
    boresight: BoresightSection = Field(default=BoresightSection(), description="Where the beam is off the gimbal.")
    backlash: BacklashSection = Field(default=BacklashSection(), description="Play of the axes.")

    def cone(self, margin_deg: float | None = None) -> Cone:
        axis, boresight = self.elevation, self.boresight
        margin = self.margin_deg if margin_deg is None else margin_deg
        return Cone(margin, boresight.elevation_deg, boresight.cross_deg, axis.min_deg, axis.max_deg)

    @property
    def play(self) -> Backlash:
        return Backlash(self.backlash.azimuth_deg, self.backlash.elevation_deg)


class ProfileSection(Section):
    method: Literal["single", "three", "search", "free"] = Field(
        default="free",
        description=(
            "One station, three, searching, or the free path (docs/onboard.md).  Decides how slow the profile is."
        ),
    )
    objective: Literal["peak", "imaging"] = Field(
        default="peak",
        description=(
            "What is made small: the peak rate of the pass, or that while the camera works.  Decides where the "
            "profile is slow."
        ),
    )


class PassFile(Section):
    satellite: SatelliteSection = Field(description="Which satellite it is.")
    elements: Annotated[ElementsFileSection | BrouwerSection, Field(discriminator="kind")] = Field(
        description="Where its orbit comes from; the keys are those of the kind."
    )
    station: GroundStation = Field(description="The station on the ground.")
    when: PassSection = Field(alias="pass", description="Which pass.")
    antenna: AntennaSection = Field(description="The satellite's antenna.")
    attitude: AttitudeSection = Field(default=AttitudeSection(), description="How the body turns; without any: nadir.")
    profile: ProfileSection = Field(default=ProfileSection(), description="How the profile is made.")
    time: TimeSection = Field(
        default=TimeSection(), description="How the Earth is turned; the clock itself is the system's."
    )

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

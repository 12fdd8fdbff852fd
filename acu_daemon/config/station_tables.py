"""The tables of station.toml: keys, defaults, what each value may be."""

from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from acu_daemon.config.antenna_tables import AtmosphereSection, MountSection, antenna_of
from acu_daemon.config.section import Name, Positive, Section
from acu_daemon.edge.link import make_link
from acu_daemon.errors import UsageError
from acu_daemon.model import AxisLimits, EarthOrientation, Site, Station
from acu_daemon.protocol.sa3842 import address_byte

LEAST_LOW_WATER_S = 4.0  # a niced fit on a busy machine takes a second: less would end good ones (daemon.background)


class StationSection(Section):
    latitude_deg: float = Field(ge=-90, le=90)
    longitude_deg: float = Field(ge=-180, le=360)
    height_m: float = Field(ge=-500, le=9000)
    name: Name = "station"
    min_elevation_deg: float = Field(default=5.0, ge=0, lt=90)
    uncertainty_m: float = Field(default=0.0, ge=0)


class AxisSection(Section):
    min_deg: float = Field(ge=-720, le=720)
    max_deg: float = Field(ge=-720, le=720)
    max_rate_deg_s: float = Field(gt=0, le=90)
    max_acceleration_deg_s2: float = Field(gt=0, le=360)

    @model_validator(mode="after")
    def _min_below_max(self) -> "AxisSection":
        self._must_be_below("min_deg", "max_deg")
        return self

    def limits(self) -> AxisLimits:
        return AxisLimits(self.min_deg, self.max_deg, self.max_rate_deg_s, self.max_acceleration_deg_s2)


class ElevationSection(AxisSection):
    min_deg: float = Field(ge=-90, le=180)
    max_deg: float = Field(ge=-90, le=180)


def _address(value: object) -> str:
    text = str(value)
    address_byte(text)
    return text


def _url(value: str) -> str:
    try:
        make_link(value)
    except UsageError as error:
        raise ValueError(str(error)) from None
    return value


class AcuSection(Section):
    url: Annotated[str, AfterValidator(_url)]
    azimuth: AxisSection
    elevation: ElevationSection
    dialect: Literal["sa3842"] = "sa3842"
    address: Annotated[str, BeforeValidator(_address)] = "1"
    period_s: float = Field(default=0.1, ge=0.1, le=0.15)  # six readings must show a rate, one lost reply no lost link
    device_delay_s: float = Field(default=0.010, ge=0, le=0.1)


class ReceiverSection(Section):
    beamwidth_deg: float = Field(default=1.0, gt=0, le=30)
    lock_dwell_s: float = Field(default=1.0, ge=0, le=60)


class TimeSection(Section):
    ut1_utc_s: float = Field(default=0.0, ge=-1, le=1)
    polar_motion_x_arcsec: float = Field(default=0.0, ge=-2, le=2)
    polar_motion_y_arcsec: float = Field(default=0.0, ge=-2, le=2)
    earth_orientation: Name | None = None  # a finals2000A or C04 file, in place of the three numbers

    @model_validator(mode="after")
    def _numbers_or_a_file(self) -> "TimeSection":
        if self.earth_orientation is not None and (typed := sorted(self.model_fields_set - {"earth_orientation"})):
            raise ValueError(
                f"earth_orientation = {self.earth_orientation!r} and {', '.join(typed)}: expected the file or the "
                "numbers, not both; leave the numbers out"
            )
        return self

    @property
    def orientation(self) -> EarthOrientation:
        return EarthOrientation(self.ut1_utc_s, self.polar_motion_x_arcsec, self.polar_motion_y_arcsec)


class ReadingsSection(Section):
    sigma_azimuth_deg: Positive = 0.05
    sigma_elevation_deg: Positive = 0.05
    bias_sigma_azimuth_deg: float = Field(default=0.1, ge=0)
    bias_sigma_elevation_deg: float = Field(default=0.1, ge=0)
    bias_sigma_azimuth_sec_deg: float = Field(default=0.003, ge=0)  # grows as 1 / cos(el): the axes are not square
    bias_sigma_elevation_cot_deg: float = Field(default=0.0, ge=0)  # grows as cot(el), towards the horizon


class TrackingSection(Section):
    horizon_s: float = Field(default=90.0, ge=10, le=600)
    low_water_s: float = Field(default=30.0, le=500)
    max_fit_elevation_deg: float = Field(default=80.0, gt=0, le=90)
    estimator: Literal["circular", "deterministic", "kalman", "full"] = "full"
    preposition_s: float = Field(default=120.0, ge=10, le=3600)
    search_along_s: Positive = 10.0
    search_across_deg: Positive = 2.0

    @model_validator(mode="after")
    def _water_below_horizon(self) -> "TrackingSection":
        if self.low_water_s < LEAST_LOW_WATER_S:
            raise ValueError(
                f"low_water_s = {self.low_water_s:g}: expected at least {LEAST_LOW_WATER_S:g}, of which half is for an "
                "answer of the fit process, also one that starts, and half for a buffer made without it"
            )
        self._must_be_below("low_water_s", "horizon_s")
        return self


class SafetySection(Section):
    arm: Literal["auto", "manual"] = "auto"
    register_watchdog_s: float = Field(default=5.0, ge=0, le=600)  # the ACU's W; 0: it is not touched
    following_error_deg: float = Field(default=1.0, ge=0.2, le=30)  # on the sky; less is lag, noise and wind
    following_error_s: float = Field(default=2.0, ge=0, le=60)  # 0: the axes are not watched
    clock_alarm_beam_fraction: float = Field(default=0.1, gt=0, le=10)

    @model_validator(mode="after")
    def _none_or_enough(self) -> "SafetySection":
        for name, least_s in (("register_watchdog_s", 2.0), ("following_error_s", 0.5)):
            if 0.0 < getattr(self, name) < least_s:
                raise ValueError(f"{name} = {getattr(self, name):g}: expected 0 (off) or at least {least_s:g}")
        return self


class StationFile(Section):
    station: StationSection
    acu: AcuSection
    receiver: ReceiverSection = ReceiverSection()
    time: TimeSection = TimeSection()
    readings: ReadingsSection = ReadingsSection()
    tracking: TrackingSection = TrackingSection()
    safety: SafetySection = SafetySection()
    atmosphere: AtmosphereSection = AtmosphereSection()
    mount: MountSection = MountSection()

    @model_validator(mode="after")
    def _is_some_air(self) -> "StationFile":
        s = self.station
        self.atmosphere.check(Station(s.name, s.latitude_deg, s.longitude_deg, s.height_m))
        return self

    @property
    def site(self) -> Site:
        s = self.station
        station = Station(s.name, s.latitude_deg, s.longitude_deg, s.height_m)
        return Site(station, self.time.orientation, antenna=antenna_of(self.atmosphere, self.mount, station))

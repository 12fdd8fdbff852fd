"""station.toml and satellites/NAME.toml: read, checked, turned into the rooms' values (design section 7).

Unknown keys, wrong units and impossible values stop the start with file, key, value and what was expected.
"""

import tomllib
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from acu_daemon.assist.estimator import EstimatorSettings
from acu_daemon.control.state import ControlConfig
from acu_daemon.errors import ConfigError
from acu_daemon.model import AxisLimits, EarthOrientation, Site, Station
from acu_daemon.orbit.elements import ElementLimits
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.protocol.sa3842 import address_byte

DEFAULT_LIMITS = ElementLimits()
HALF_SERVO_TICK_S = 0.010  # ICD section 6: a command waits for half a 50 Hz servo tick on average


def _tai(value: object) -> float:
    if isinstance(value, datetime):
        if value.tzinfo is None:
            raise ValueError("the time must end in Z (UTC)")
        return tai_from_utc(value.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ"))
    if isinstance(value, str):
        return tai_from_utc(value)
    raise ValueError("expected a time like 1989-01-31T09:58:00Z")


UtcTime = Annotated[float, BeforeValidator(_tai)]
Positive = Annotated[float, Field(gt=0)]


class Section(BaseModel):
    """A table of a TOML file: no unknown keys, no infinite numbers, no text where a number belongs."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class StationSection(Section):
    latitude_deg: float = Field(ge=-90, le=90)
    longitude_deg: float = Field(ge=-180, le=360)
    height_m: float = Field(ge=-500, le=9000)
    name: str = "station"
    min_elevation_deg: float = Field(default=5.0, ge=0, lt=90)
    uncertainty_m: float = Field(default=0.0, ge=0)


class AxisSection(Section):
    min_deg: float = Field(ge=-720, le=720)
    max_deg: float = Field(ge=-720, le=720)
    max_rate_deg_s: float = Field(gt=0, le=90)
    max_acceleration_deg_s2: float = Field(gt=0, le=360)

    @model_validator(mode="after")
    def _min_below_max(self) -> "AxisSection":
        if self.min_deg >= self.max_deg:
            raise ValueError(f"min_deg must be below max_deg = {self.max_deg:g}")
        return self

    def limits(self) -> AxisLimits:
        return AxisLimits(self.min_deg, self.max_deg, self.max_rate_deg_s, self.max_acceleration_deg_s2)


def _address(value: object) -> str:
    text = str(value)
    address_byte(text)
    return text


class AcuSection(Section):
    url: str
    azimuth: AxisSection
    elevation: AxisSection
    dialect: Literal["sa3842"] = "sa3842"
    address: Annotated[str, BeforeValidator(_address)] = "1"
    period_s: float = Field(default=0.1, ge=0.1, le=1.0)
    device_delay_s: float = Field(default=0.010, ge=0, le=0.1)


class ReceiverSection(Section):
    beamwidth_deg: float = Field(default=1.0, gt=0, le=30)
    lock_dwell_s: float = Field(default=1.0, ge=0, le=60)


class TimeSection(Section):
    ut1_utc_s: float = Field(default=0.0, ge=-1, le=1)
    polar_motion_x_arcsec: float = Field(default=0.0, ge=-2, le=2)
    polar_motion_y_arcsec: float = Field(default=0.0, ge=-2, le=2)


class ReadingsSection(Section):
    sigma_azimuth_deg: Positive = 0.05
    sigma_elevation_deg: Positive = 0.05
    bias_sigma_azimuth_deg: float = Field(default=0.1, ge=0)
    bias_sigma_elevation_deg: float = Field(default=0.1, ge=0)


class TrackingSection(Section):
    horizon_s: float = Field(default=90.0, ge=10, le=600)
    low_water_s: float = Field(default=30.0, ge=2, le=500)
    max_fit_elevation_deg: float = Field(default=80.0, gt=0, le=90)
    estimator: Literal["circular", "deterministic", "kalman", "full"] = "full"
    preposition_s: float = Field(default=120.0, ge=10, le=3600)
    search_along_s: Positive = 10.0
    search_across_deg: Positive = 2.0

    @model_validator(mode="after")
    def _water_below_horizon(self) -> "TrackingSection":
        if self.low_water_s >= self.horizon_s:
            raise ValueError(f"low_water_s must be below horizon_s = {self.horizon_s:g}")
        return self


class SafetySection(Section):
    arm: Literal["auto", "manual"] = "auto"


class StationFile(Section):
    station: StationSection
    acu: AcuSection
    receiver: ReceiverSection = ReceiverSection()
    time: TimeSection = TimeSection()
    readings: ReadingsSection = ReadingsSection()
    tracking: TrackingSection = TrackingSection()
    safety: SafetySection = SafetySection()

    @property
    def site(self) -> Site:
        s, t = self.station, self.time
        return Site(
            Station(s.name, s.latitude_deg, s.longitude_deg, s.height_m),
            EarthOrientation(t.ut1_utc_s, t.polar_motion_x_arcsec, t.polar_motion_y_arcsec),
        )


class SatelliteSection(Section):
    name: str
    norad_id: int | None = Field(default=None, ge=1, le=999999999)


class LimitsSection(Section):
    """Sanity limits of this satellite's elements; the defaults suit low orbits."""

    min_semi_major_axis_km: Positive = DEFAULT_LIMITS.min_semi_major_axis_km
    max_semi_major_axis_km: Positive = DEFAULT_LIMITS.max_semi_major_axis_km
    min_eccentricity: float = Field(default=DEFAULT_LIMITS.min_eccentricity, ge=0, lt=1)
    max_eccentricity: float = Field(default=DEFAULT_LIMITS.max_eccentricity, ge=0, lt=1)
    min_inclination_deg: float = Field(default=DEFAULT_LIMITS.min_inclination_deg, ge=0, le=180)
    max_inclination_deg: float = Field(default=DEFAULT_LIMITS.max_inclination_deg, ge=0, le=180)
    warn_age_days: Positive = DEFAULT_LIMITS.warn_age_days
    max_age_days: Positive = DEFAULT_LIMITS.max_age_days

    def limits(self) -> ElementLimits:
        return ElementLimits(**self.model_dump())


class ElementsFileSection(Section):
    kind: Literal["tle", "omm", "oem"]
    file: str
    limits: LimitsSection = LimitsSection()


class BrouwerSection(Section):
    kind: Literal["brouwer"]
    epoch_utc: UtcTime
    semi_major_axis_km: Positive
    eccentricity: float = Field(ge=0, lt=1)
    inclination_deg: float = Field(ge=0, le=180)
    raan_deg: float = Field(ge=-360, le=360)
    arg_perigee_deg: float = Field(ge=-360, le=360)
    mean_anomaly_deg: float = Field(ge=-360, le=360)
    short_period: bool = True
    limits: LimitsSection = LimitsSection()


class UncertaintySection(Section):
    position_km: Positive | None = None
    velocity_m_s: Positive | None = None


class FallbackSection(Section):
    acquire_s: float = Field(default=60.0, ge=0)
    hold_s: float = Field(default=1200.0, ge=0)
    search_s: float = Field(default=120.0, ge=0)


class SatelliteFile(Section):
    satellite: SatelliteSection
    elements: Annotated[ElementsFileSection | BrouwerSection, Field(discriminator="kind")]
    uncertainty: UncertaintySection = UncertaintySection()
    fallback: FallbackSection = FallbackSection()
    receiver: dict[str, Any] = {}
    readings: dict[str, Any] = {}
    tracking: dict[str, Any] = {}


File = TypeVar("File", bound=Section)


def load_station(directory: Path) -> StationFile:
    """Read DIR/station.toml.  ConfigError: names file, key, value and what was expected."""
    return _parse(StationFile, directory / "station.toml", _read(directory / "station.toml"))


def satellite_names(directory: Path) -> list[str]:
    """Names of the satellites' files, sorted."""
    return sorted(path.stem for path in (directory / "satellites").glob("*.toml"))


def load_satellite(directory: Path, name: str, station: StationFile) -> tuple[SatelliteFile, StationFile]:
    """Read DIR/satellites/NAME.toml; also the station with that file's overrides applied."""
    path = directory / "satellites" / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(satellite_names(directory)) or "none"
        raise ConfigError(f"{path}: no such file; satellites in {directory}: {known}")
    satellite = _parse(SatelliteFile, path, _read(path))
    sections: dict[str, Section] = {
        "receiver": station.receiver,
        "readings": station.readings,
        "tracking": station.tracking,
    }
    for key, section in sections.items():
        override: dict[str, Any] = getattr(satellite, key)
        sections[key] = _parse(type(section), path, section.model_dump() | override, under=key)
    return satellite, station.model_copy(update=sections)


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; it must hold the station's [station] and [acu] tables") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: not TOML: {error}") from None


def _parse(model: type[File], path: Path, values: dict[str, Any], under: str = "") -> File:
    try:
        return model.model_validate(values)
    except ValidationError as error:
        problems = [_problem(path, under, dict(item)) for item in error.errors()]
        raise ConfigError("\n".join(problems)) from None


def _problem(path: Path, under: str, item: dict[str, Any]) -> str:
    """One line of the complaint: file, key, value, what was expected."""
    parts = [str(part) for part in item["loc"] if part not in ("tle", "omm", "oem", "brouwer")]
    key = ".".join(([under] if under else []) + parts)
    if item["type"] == "missing":
        return f"{path}: {key} is missing"
    if item["type"] == "extra_forbidden":
        return f"{path}: {key} = {item['input']!r}: unknown key; is it misspelt, or in the wrong table?"
    expected = item["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    value = "" if isinstance(item["input"], dict) else f" = {item['input']!r}"
    return f"{path}: {key}{value}: expected {expected}"


def control_config(station: StationFile, satellite: SatelliteFile, byte_time_s: float) -> ControlConfig:
    """What the decision of a tick needs; byte_time_s is the wire time of one character (0 on TCP)."""
    acu = station.acu
    wire_s = 17 * byte_time_s  # a WRITE AND STATUS command, ICD section 4
    return ControlConfig(
        azimuth=acu.azimuth.limits(),
        elevation=acu.elevation.limits(),
        period_s=acu.period_s,
        sample_delay_s=wire_s + acu.device_delay_s,
        poll_sample_delay_s=5 * byte_time_s + acu.device_delay_s,
        effect_delay_s=wire_s + acu.device_delay_s + HALF_SERVO_TICK_S,
        beamwidth_deg=station.receiver.beamwidth_deg,
        lock_dwell_s=station.receiver.lock_dwell_s,
        min_elevation_deg=station.station.min_elevation_deg,
        preposition_s=station.tracking.preposition_s,
        acquire_s=satellite.fallback.acquire_s,
        hold_s=satellite.fallback.hold_s,
        search_s=satellite.fallback.search_s,
        search_along_s=station.tracking.search_along_s,
        search_across_deg=station.tracking.search_across_deg,
        is_armed=station.safety.arm == "auto",
    )


def estimator_settings(station: StationFile) -> EstimatorSettings:
    """What the estimators need of the configuration."""
    return EstimatorSettings(
        sigma_azimuth_deg=station.readings.sigma_azimuth_deg,
        sigma_elevation_deg=station.readings.sigma_elevation_deg,
        max_fit_elevation_deg=station.tracking.max_fit_elevation_deg,
        beamwidth_deg=station.receiver.beamwidth_deg,
        azimuth=station.acu.azimuth.limits(),
        elevation=station.acu.elevation.limits(),
    )

"""[atmosphere] and [mount] of station.toml: the air that the antenna looks through, and what a survey says of it."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from pydantic import Field, ValidationError, field_validator, model_validator

from acu_daemon.config.problems import in_words
from acu_daemon.config.section import Name, Section
from acu_daemon.model import Station
from acu_daemon.pointing.air import Air, refractivity, standard_air
from acu_daemon.pointing.antenna_model import AntennaModel, refraction_at_45_deg
from acu_daemon.pointing.mount import MOST_DEG, TERMS, Mount
from acu_daemon.pointing.refraction import MOST_N, Refraction, traced

SCALE_SIGMA = 0.08  # of the refraction: of told weather that is within 10 %, 0.06; of one that is 8 % off, 0.08
SUM = f"{MOST_DEG:g} with CA, NPAE, AN and AW in sum, without signs"
MOST_FROM_STANDARD_PRESSURE = 0.15  # weather is within 0.06; more is a pressure reduced to sea level


class AtmosphereSection(Section):
    refraction: bool = Field(
        default=True,
        description=(
            "Whether there is air; false is a vacuum, for the daemon and for `fake-acu`.  Decides whether directions "
            "are raised by refraction: 0.2 deg at 5 deg of elevation, 0.03 at 30."
        ),
    )
    pressure_hpa: float | None = Field(
        default=None,
        ge=200,
        le=1100,
        json_schema_extra={"range": "within 15 % of what is usual at height_m"},
        description=(
            "Pressure at the antenna, not reduced to sea level; left out: the standard air's.  Decides the refraction."
        ),
    )
    temperature_c: float | None = Field(
        default=None, ge=-80, le=60, description="Temperature; left out: the standard air's.  Decides the same."
    )
    humidity_percent: float | None = Field(
        default=None, ge=0, le=100, description="Relative humidity; left out: the standard air's.  Decides the same."
    )
    weather_file: Name | None = Field(
        default=None,
        description=(
            "A JSON file beside station.toml, or elsewhere, that a weather station keeps: pressure_hpa, temperature_c, "
            "humidity_percent, utc.  Decides the same, in place of the values here, while it is fresh."
        ),
    )
    weather_udp: Name | None = Field(
        default=None,
        json_schema_extra={"range": "ADDRESS:PORT"},
        description=(
            "An address of this machine, such as 127.0.0.1:4840, at which datagrams with the same JSON arrive.  "
            "Decides the same."
        ),
    )
    weather_max_age_s: float = Field(
        default=3600.0,
        ge=10,
        le=86400,
        description="How old such weather may be; then the values here are used again, with a warning.  Decides that.",
    )

    @field_validator("weather_udp")
    @classmethod
    def _is_address(cls, value: str | None) -> str | None:
        if value is not None:
            host, _, port = value.rpartition(":")
            if not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
                raise ValueError("expected ADDRESS:PORT, such as 127.0.0.1:4840")
        return value

    @property
    def has_live_weather(self) -> bool:
        return self.refraction and (self.weather_file is not None or self.weather_udp is not None)

    def with_weather(self, values: Mapping[str, Any], station: Station) -> "AtmosphereSection":
        """The table with the weather that a source tells.  ValueError: no weather is like that, and why."""
        try:
            told = type(self).model_validate(self.model_dump() | dict(values))
        except ValidationError as error:
            raise ValueError("; ".join(in_words(dict(item)) for item in error.errors())) from None
        told.check(station)
        return told

    def air(self, station: Station) -> Air:
        """The weather: what is given, the rest that of the standard air at the station's height and latitude."""
        standard = standard_air(station)
        return Air(
            standard.pressure_hpa if self.pressure_hpa is None else self.pressure_hpa,
            standard.temperature_c if self.temperature_c is None else self.temperature_c,
            standard.humidity_percent if self.humidity_percent is None else self.humidity_percent,
        )

    def traced(self, station: Station) -> Refraction | None:
        """The refraction of that air; None: a vacuum."""
        return traced(refractivity(self.air(station)), station) if self.refraction else None

    def told(self, station: Station) -> str:
        """Say what air is reckoned with, and what it raises; empty: none."""
        refraction = self.traced(station)
        if refraction is None:
            return ""
        air = self.air(station)
        given = {"pressure_hpa", "temperature_c", "humidity_percent"} & self.model_fields_set
        whence = "as given" if len(given) == 3 else "part of it the standard air's" if given else "the standard air's"
        raised_deg = float(refraction.apparent_el_deg(5.0, 1.5e6)) - 5.0
        return (
            f"{air.pressure_hpa:.0f} hPa, {air.temperature_c:.0f} deg C, {air.humidity_percent:.0f} % humidity, "
            f"{whence}: N {refraction.surface_n:.0f}, a satellite at 5 deg appears {raised_deg:.2f} deg higher"
        )

    def cot_sigma_deg(self, station: Station) -> float:
        """1 sigma of the refraction's scale, as it moves a satellite at 45 deg of elevation, where cot(el) is 1."""
        refraction = self.traced(station)
        return 0.0 if refraction is None else SCALE_SIGMA * refraction_at_45_deg(refraction)

    def check(self, station: Station) -> None:
        """ValueError: no air of a station is like that."""
        usual_hpa = standard_air(station).pressure_hpa
        if self.pressure_hpa is not None and abs(self.pressure_hpa / usual_hpa - 1.0) > MOST_FROM_STANDARD_PRESSURE:
            raise ValueError(
                f"atmosphere.pressure_hpa = {self.pressure_hpa:g}: at {station.height_m:g} m about {usual_hpa:.0f} hPa "
                "are usual; expected the pressure at the antenna, not reduced to sea level"
            )
        air = self.air(station)
        if (n := refractivity(air)) > MOST_N:
            raise ValueError(
                f"atmosphere: air of {air.temperature_c:g} deg C, {air.humidity_percent:.0f} % humidity and "
                f"{air.pressure_hpa:.0f} hPa has a refractivity of {n:.0f}, expected at most {MOST_N:g} (saturated at "
                "35 deg C); what is left out of pressure_hpa, temperature_c and humidity_percent is the standard air's"
            )


class MountSection(Section):
    """What a survey gave, encoder = apparent direction + terms; a sigma is 1 sigma, None: not surveyed."""

    ia_deg: float = Field(
        default=0.0,
        ge=-180,
        le=180,
        description="The azimuth encoder reads high (IA).  Decides what the encoders show, in readings and commands.",
    )
    ie_deg: float = Field(
        default=0.0,
        ge=-10,
        le=10,
        description="The elevation encoder reads high (IE).  Decides what the encoders show, in readings and commands.",
    )
    ca_deg: float = Field(
        default=0.0,
        json_schema_extra={"range": SUM},
        description=(
            "The beam lies left of the perpendicular to the elevation axis (CA).  Decides what the encoders show, in "
            "readings and commands."
        ),
    )
    npae_deg: float = Field(
        default=0.0,
        json_schema_extra={"range": SUM},
        description=(
            "The elevation axis's right end is high (NPAE).  Decides what the encoders show, in readings and commands."
        ),
    )
    an_deg: float = Field(
        default=0.0,
        json_schema_extra={"range": SUM},
        description="The azimuth axis leans north (AN).  Decides what the encoders show, in readings and commands.",
    )
    aw_deg: float = Field(
        default=0.0,
        json_schema_extra={"range": SUM},
        description="The azimuth axis leans west (AW).  Decides what the encoders show, in readings and commands.",
    )
    tf_deg: float = Field(
        default=0.0,
        ge=-1,
        le=1,
        description=(
            "The beam sags, by this times cos(el) (TF).  Decides what the encoders show, in readings and commands."
        ),
    )
    ia_sigma_deg: float | None = Field(
        default=None,
        ge=0,
        le=10,
        description="How well IA is known, 1 sigma; left out: not surveyed.  Decides how far a fit may move it, "
        "in place of [readings] bias_sigma_azimuth_deg.",
    )
    ie_sigma_deg: float | None = Field(
        default=None,
        ge=0,
        le=10,
        description="How well IE is known, 1 sigma; left out: not surveyed.  Decides how far a fit may move it, "
        "in place of [readings] bias_sigma_elevation_deg.",
    )
    ca_sigma_deg: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="How well CA is known, 1 sigma; left out: not surveyed.  Decides how far a fit may move it, "
        "in place of [readings] bias_sigma_azimuth_sec_deg.",
    )
    npae_sigma_deg: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="How well NPAE is known, 1 sigma; left out: not surveyed.  Decides how far a fit may move it, "
        "which without a sigma it does not.",
    )
    an_sigma_deg: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="How well AN is known, 1 sigma; left out: not surveyed.  Decides how far a fit may move it, "
        "which without a sigma it does not.",
    )
    aw_sigma_deg: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="How well AW is known, 1 sigma; left out: not surveyed.  Decides how far a fit may move it, "
        "which without a sigma it does not.",
    )
    tf_sigma_deg: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="How well TF is known, 1 sigma; left out: not surveyed.  Decides how far a fit may move it, "
        "which without a sigma it does not.",
    )

    @model_validator(mode="after")
    def _encoders_tell_one_direction(self) -> "MountSection":
        total_deg = sum(abs(getattr(self, name)) for name in ("ca_deg", "npae_deg", "an_deg", "aw_deg"))
        if total_deg > MOST_DEG:
            raise ValueError(
                f"ca_deg, npae_deg, an_deg and aw_deg are {total_deg:g} in sum: expected at most {MOST_DEG:g} without "
                "their signs, up to which the encoders tell one direction everywhere"
            )
        return self

    @property
    def axis_sigmas_deg(self) -> tuple[float, float, float, float]:
        """Of NPAE, AN, AW and TF; 0 of one that no survey gave: it stays as it is."""
        return self.npae_sigma_deg or 0.0, self.an_sigma_deg or 0.0, self.aw_sigma_deg or 0.0, self.tf_sigma_deg or 0.0

    def mount(self) -> Mount:
        return Mount(**{name: getattr(self, name) for name in TERMS})


@lru_cache(maxsize=8)
def antenna_of(atmosphere: AtmosphereSection, mount: MountSection, station: Station) -> AntennaModel | None:
    """The antenna's air and mount; None: a perfect mount in a vacuum.  ValueError: no such air."""
    model = AntennaModel(mount.mount(), atmosphere.traced(station))
    return None if model == AntennaModel() else model

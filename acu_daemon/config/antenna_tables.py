"""[atmosphere] and [mount] of station.toml: the air that the antenna looks through, and what a survey says of it."""

from functools import lru_cache

from pydantic import Field, model_validator

from acu_daemon.config.section import Section
from acu_daemon.model import Station
from acu_daemon.pointing.air import Air, refractivity, standard_air
from acu_daemon.pointing.antenna_model import AntennaModel, refraction_at_45_deg
from acu_daemon.pointing.mount import MOST_DEG, TERMS, Mount
from acu_daemon.pointing.refraction import MOST_N, Refraction, traced

REFRACTION_BY_DEFAULT = False  # of daemon and simulator alike, where [atmosphere] refraction is left out
SCALE_SIGMA = 0.1  # of the refraction, against the weather told
MOST_FROM_STANDARD_PRESSURE = 0.15  # weather is within 0.06; more is a pressure reduced to sea level


class AtmosphereSection(Section):
    refraction: bool | None = None
    pressure_hpa: float | None = Field(default=None, ge=200, le=1100)
    temperature_c: float | None = Field(default=None, ge=-80, le=60)
    humidity_percent: float | None = Field(default=None, ge=0, le=100)

    @property
    def has_refraction(self) -> bool:
        return REFRACTION_BY_DEFAULT if self.refraction is None else self.refraction

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
        return traced(refractivity(self.air(station)), station) if self.has_refraction else None

    def cot_sigma_deg(self, station: Station) -> float:
        """What a tenth of the refraction is at 45 deg of elevation, where cot(el) is 1: 1 sigma of a scale."""
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

    ia_deg: float = Field(default=0.0, ge=-180, le=180)
    ie_deg: float = Field(default=0.0, ge=-10, le=10)
    ca_deg: float = 0.0
    npae_deg: float = 0.0
    an_deg: float = 0.0
    aw_deg: float = 0.0
    tf_deg: float = Field(default=0.0, ge=-1, le=1)
    ia_sigma_deg: float | None = Field(default=None, ge=0, le=10)
    ie_sigma_deg: float | None = Field(default=None, ge=0, le=10)
    ca_sigma_deg: float | None = Field(default=None, ge=0, le=1)
    npae_sigma_deg: float | None = Field(default=None, ge=0, le=1)
    an_sigma_deg: float | None = Field(default=None, ge=0, le=1)
    aw_sigma_deg: float | None = Field(default=None, ge=0, le=1)
    tf_sigma_deg: float | None = Field(default=None, ge=0, le=1)

    @model_validator(mode="after")
    def _encoders_tell_one_direction(self) -> "MountSection":
        total_deg = sum(abs(getattr(self, name)) for name in ("ca_deg", "npae_deg", "an_deg", "aw_deg"))
        if total_deg > MOST_DEG:
            raise ValueError(
                f"ca_deg, npae_deg, an_deg and aw_deg are {total_deg:g} in sum: expected at most {MOST_DEG:g} without "
                "their signs, up to which the encoders tell one direction everywhere"
            )
        return self

    def mount(self) -> Mount:
        return Mount(**{name: getattr(self, name) for name in TERMS})


@lru_cache(maxsize=8)
def antenna_of(atmosphere: AtmosphereSection, mount: MountSection, station: Station) -> AntennaModel | None:
    """The antenna's air and mount; None: a perfect mount in a vacuum.  ValueError: no such air."""
    model = AntennaModel(mount.mount(), atmosphere.traced(station))
    return None if model == AntennaModel() else model

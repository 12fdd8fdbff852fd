"""The tables of satellites/NAME.toml: keys, defaults, what each value may be."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from acu_daemon.config.section import Name, Positive, Section, UtcTime
from acu_daemon.orbit.elements import ElementLimits

DEFAULT_LIMITS = ElementLimits()


class SatelliteSection(Section):
    name: Name
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

    @model_validator(mode="after")
    def _min_below_max(self) -> "LimitsSection":
        for what in ("semi_major_axis_km", "eccentricity", "inclination_deg"):
            self._must_be_below(f"min_{what}", f"max_{what}")
        return self

    def limits(self) -> ElementLimits:
        return ElementLimits(**self.model_dump())


class ElementsFileSection(Section):
    kind: Literal["tle", "omm", "oem"]
    file: str
    limits: LimitsSection = LimitsSection()


class BrouwerSection(Section):
    kind: Literal["brouwer"]
    epoch_utc: UtcTime
    semi_major_axis_km: float = Field(ge=1_000, le=1_000_000)
    eccentricity: float = Field(ge=0, lt=1)
    inclination_deg: float = Field(ge=0, le=180)
    raan_deg: float = Field(ge=-360, le=360)
    arg_perigee_deg: float = Field(ge=-360, le=360)
    mean_anomaly_deg: float = Field(ge=-360, le=360)
    short_period: bool = True
    limits: LimitsSection = LimitsSection()


class UncertaintySection(Section):
    position_km: float | None = Field(default=None, gt=0, le=300)  # a fit from much more may end on no orbit at all
    velocity_m_s: float | None = Field(default=None, gt=0, le=300)


class FallbackSection(Section):
    acquire_s: float = Field(default=60.0, ge=0)
    hold_s: float = Field(default=1200.0, ge=0)
    search_s: float = Field(default=120.0, ge=0)


class SatelliteFile(Section):
    satellite: SatelliteSection
    elements: Annotated[ElementsFileSection | BrouwerSection, Field(discriminator="kind")]
    uncertainty: UncertaintySection = UncertaintySection()
    fallback: FallbackSection = FallbackSection()
    receiver: dict[str, Any] = Field(default={})
    readings: dict[str, Any] = Field(default={})
    tracking: dict[str, Any] = Field(default={})

"""The tables of satellites/NAME.toml: keys, defaults, what each value may be."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from acu_daemon.config.schedule_tables import SatelliteScheduleSection
from acu_daemon.config.section import Name, Positive, Section, UtcTime
from acu_daemon.orbit.elements import ElementLimits

DEFAULT_LIMITS = ElementLimits()


class SatelliteSection(Section):
    name: Name = Field(
        description=(
            "The satellite's name, for people.  Decides which set of elements of a list is used where there is no "
            "norad_id."
        ),
    )
    norad_id: int | None = Field(
        default=None,
        ge=1,
        le=999999999,
        description=(
            "Catalogue number; left out: elements are found by name.  Decides which set of elements of a list is used."
        ),
    )


class LimitsSection(Section):
    """Sanity limits of this satellite's elements; the defaults suit low orbits."""

    min_semi_major_axis_km: Positive = Field(
        default=DEFAULT_LIMITS.min_semi_major_axis_km,
        description="Least semi-major axis.  Decides which elements are refused as another orbit's.",
    )
    max_semi_major_axis_km: Positive = Field(
        default=DEFAULT_LIMITS.max_semi_major_axis_km,
        json_schema_extra={"range": "above min_semi_major_axis_km"},
        description="Largest semi-major axis; raise it for higher orbits.  Decides the same.",
    )
    min_eccentricity: float = Field(
        default=DEFAULT_LIMITS.min_eccentricity, ge=0, lt=1, description="Least eccentricity.  Decides the same."
    )
    max_eccentricity: float = Field(
        default=DEFAULT_LIMITS.max_eccentricity,
        ge=0,
        lt=1,
        json_schema_extra={"range": "min_eccentricity to < 1"},
        description="Largest eccentricity.  Decides the same.",
    )
    min_inclination_deg: float = Field(
        default=DEFAULT_LIMITS.min_inclination_deg, ge=0, le=180, description="Least inclination.  Decides the same."
    )
    max_inclination_deg: float = Field(
        default=DEFAULT_LIMITS.max_inclination_deg,
        ge=0,
        le=180,
        json_schema_extra={"range": "min_inclination_deg to 180"},
        description="Largest inclination.  Decides the same.",
    )
    warn_age_days: Positive = Field(
        default=DEFAULT_LIMITS.warn_age_days,
        description=(
            "Age of the elements, against the clock in force, from which on they are warned of.  Decides WARN in "
            "`check`."
        ),
    )
    max_age_days: Positive = Field(
        default=DEFAULT_LIMITS.max_age_days,
        description="Age from which on they are refused.  Decides NO-GO in `check`, exit status 2 of `run`.",
    )

    @model_validator(mode="after")
    def _min_below_max(self) -> "LimitsSection":
        for what in ("semi_major_axis_km", "eccentricity", "inclination_deg"):
            self._must_be_below(f"min_{what}", f"max_{what}")
        return self

    def limits(self) -> ElementLimits:
        return ElementLimits(**self.model_dump())


class ElementsFileSection(Section):
    kind: Literal["tle", "omm", "oem", "cpf", "sp3"] = Field(
        description=(
            "What the file holds: two-line elements, an orbit mean-elements message, an ephemeris (CCSDS OEM, CPF of "
            "the ILRS, SP3).  Decides how the satellite moves: SGP4, or interpolation."
        ),
    )
    file: str = Field(
        json_schema_extra={"range": "a path"},
        description=(
            "The file, relative to this TOML (docs/elements.md says what is read).  Decides the elements; it may hold "
            "those of many satellites, and many of one.  It may be packed by gzip."
        ),
    )
    object: Name | None = Field(
        default=None,
        description=(
            "What an ephemeris of several satellites calls this one, such as L56 in an SP3 file; left out: its name.  "
            "Decides which of them is used."
        ),
    )
    limits: LimitsSection = Field(
        default=LimitsSection(), description="What the elements must keep to; the defaults suit low orbits."
    )


class StationElementsSection(Section):
    kind: Literal["station"] = Field(
        description=(
            "Elements from the station's [elements] source alone, by norad_id.  Decides that no file is kept for this "
            "satellite."
        ),
    )
    object: Name | None = Field(
        default=None,
        description=(
            "What an ephemeris there calls this satellite; left out: its name.  Decides which ephemeris is its own."
        ),
    )
    limits: LimitsSection = Field(
        default=LimitsSection(), description="What the elements must keep to; the defaults suit low orbits."
    )


class BrouwerSection(Section):
    kind: Literal["brouwer"] = Field(
        description="Brouwer mean elements, written here.  Decides how the satellite moves: secular terms of J2 to J4."
    )
    epoch_utc: UtcTime = Field(
        json_schema_extra={"range": "a time that ends in Z"},
        description="The time at which the elements hold.  Decides their age, by the clock in force.",
    )
    semi_major_axis_km: float = Field(
        ge=1_000, le=1_000_000, description="Mean semi-major axis.  Decides the orbit, as all of the following."
    )
    eccentricity: float = Field(ge=0, lt=1, description="Mean eccentricity.  Decides the orbit.")
    inclination_deg: float = Field(
        ge=0, le=180, description="Mean inclination, true equator of date.  Decides the orbit."
    )
    raan_deg: float = Field(
        ge=-360, le=360, description="Right ascension of the ascending node, mean equinox of date.  Decides the orbit."
    )
    arg_perigee_deg: float = Field(ge=-360, le=360, description="Argument of perigee.  Decides the orbit.")
    mean_anomaly_deg: float = Field(ge=-360, le=360, description="Mean anomaly at the epoch.  Decides the orbit.")
    short_period: bool = Field(
        default=True,
        description=(
            "Whether the first-order short-period terms are added to the means; false: the mean orbit itself is "
            "followed.  Decides the satellite's place by up to 10 km."
        ),
    )
    limits: LimitsSection = Field(
        default=LimitsSection(), description="What the elements must keep to; the defaults suit low orbits."
    )


class UncertaintySection(Section):
    position_km: float | None = Field(
        default=None,
        gt=0,
        le=300,
        description=(
            "1 sigma of each component of the position at the epoch; left out: 1000 s times velocity_m_s, or by kind "
            "and age (docs/decisions/0015-a-priori-sigmas.md).  Decides how much `full` trusts the elements, and how "
            "wide a first search is."
        ),
    )
    velocity_m_s: float | None = Field(
        default=None,
        gt=0,
        le=300,
        description="The same of the velocity; left out: position_km over 1000 s.  Decides the same.",
    )


class FallbackSection(Section):
    acquire_s: float = Field(
        default=60.0,
        ge=0,
        description=(
            "No signal for so long after the rise: search.  Decides how long the path of the elements is believed "
            "before anything was seen."
        ),
    )
    hold_s: float = Field(
        default=1200.0,
        ge=0,
        description=(
            "After a loss the prediction is followed for so long, then searched.  It counts from when 3 sigma leave "
            "half the beam, for estimators without a sigma from the loss.  Decides when the antenna leaves a path "
            "without a signal."
        ),
    )
    search_s: float = Field(
        default=120.0,
        ge=0,
        description=(
            "Length of one search; then the path again, and the next search goes on where this one ended.  "
            "Decides how much is looked at in one go."
        ),
    )


class SatelliteFile(Section):
    satellite: SatelliteSection = Field(description="Which satellite it is.")
    elements: Annotated[ElementsFileSection | StationElementsSection | BrouwerSection, Field(discriminator="kind")] = (
        Field(description="Where its orbit comes from; the keys are those of the kind.")
    )
    uncertainty: UncertaintySection = Field(
        default=UncertaintySection(), description="What the elements are worth before the first reading."
    )
    fallback: FallbackSection = Field(
        default=FallbackSection(), description="What follows on a signal that does not come, or is lost."
    )
    schedule: SatelliteScheduleSection = Field(
        default=SatelliteScheduleSection(),
        description="What its passes are worth to a station with several satellites.",
    )
    receiver: dict[str, Any] = Field(
        default={}, description="Any keys of the station's [receiver], for this satellite alone."
    )
    readings: dict[str, Any] = Field(
        default={}, description="Any keys of the station's [readings], for this satellite alone."
    )
    tracking: dict[str, Any] = Field(
        default={}, description="Any keys of the station's [tracking], for this satellite alone."
    )

    @model_validator(mode="after")
    def _has_a_number(self) -> "SatelliteFile":
        if isinstance(self.elements, StationElementsSection) and self.satellite.norad_id is None:
            raise ValueError('elements.kind = "station" needs satellite.norad_id: the station\'s sources go by it')
        return self

"""The [schedule] tables of station.toml and of a satellite's file."""

from typing import Literal

from pydantic import Field, model_validator

from acu_daemon.config.section import Name, Section, UtcTime
from acu_daemon.model import AxisLimits
from acu_daemon.schedule.rules import PassRequest, SatelliteRules, StationRules, Window

DEFAULT = SatelliteRules()


class SatelliteScheduleSection(Section):
    priority: int = Field(
        default=DEFAULT.priority,
        ge=0,
        le=9,
        description=(
            "What a useful second of this satellite is worth; 0: only where nothing else is up.  Decides who gets the "
            "antenna where passes overlap."
        ),
    )
    min_culmination_deg: float = Field(
        default=DEFAULT.min_culmination_deg,
        ge=0,
        lt=90,
        description="Passes that stay lower are not tracked.  Decides which passes count.",
    )
    min_useful_s: float = Field(
        default=DEFAULT.min_useful_s,
        ge=1,
        le=86400,
        description="Passes, and parts of them, with fewer useful seconds are not tracked.  Decides the same.",
    )
    margin_s: float = Field(
        default=DEFAULT.margin_s,
        ge=0,
        le=600,
        description=(
            "Kept free before the rise and after the set, for signals that come early and stay late.  Decides the "
            "length of the reservation."
        ),
    )
    may_be_cut: bool = Field(
        default=DEFAULT.may_be_cut,
        description="Whether a part of a pass is worth having.  Decides whether a pass may share its time with others.",
    )
    may_interrupt: bool = Field(
        default=DEFAULT.may_interrupt,
        description=(
            "Whether a pass that is being tracked, of a lower priority, is given up for one of this satellite.  "
            "Decides what a person's word may change while a pass is on."
        ),
    )

    def rules(self) -> SatelliteRules:
        return SatelliteRules(**self.model_dump())


class MaintenanceSection(Section):
    from_utc: UtcTime = Field(
        json_schema_extra={"range": "a time that ends in Z"}, description="When it begins.  Decides which passes go."
    )
    to_utc: UtcTime = Field(
        json_schema_extra={"range": "a time that ends in Z"}, description="When it ends.  Decides the same."
    )
    reason: Name = Field(default="maintenance", description="Why, for people.  Decides what the refusal says.")

    @model_validator(mode="after")
    def _ends_later(self) -> "MaintenanceSection":
        if self.to_utc <= self.from_utc:
            raise ValueError("to_utc: expected a time after from_utc")
        return self


class ScheduleSection(Section):
    horizon_days: float = Field(
        default=2.0, ge=0.05, le=10, description="How far ahead is planned.  Decides what `acu-daemon schedule` shows."
    )
    freeze_s: float = Field(
        default=600.0,
        ge=0,
        le=86400,
        description=(
            "A pass that begins within this time stays granted, whatever else changes; a person's word apart.  Decides "
            "until when new elements may move the plan."
        ),
    )
    pre_s: float = Field(
        default=60.0,
        ge=30,
        le=3600,
        description=(
            "Before each pass, for hooks, modes and settling; the way to the rise comes on top.  Decides how near two "
            "passes may be."
        ),
    )
    post_s: float = Field(
        default=10.0, ge=1, le=3600, description="After each pass, for the safe stop and the hooks.  Decides the same."
    )
    after: Literal["next", "park", "stow", "stay"] = Field(
        default="stay",
        description=(
            "What the antenna does between passes: wait where the next one rises, park, be stowed, or stay "
            "where it is.  Decides where the antenna is when nobody looks."
        ),
    )
    next_within_s: float = Field(
        default=1800.0,
        ge=0,
        le=86400,
        description=(
            "Where the next pass is nearer than this, the antenna neither parks nor is stowed.  Decides whether it "
            "moves twice."
        ),
    )
    park_az_deg: float = Field(
        default=0.0, ge=-540, le=540, description="Where it parks, encoder azimuth.  Decides the parking place."
    )
    park_el_deg: float = Field(
        default=90.0, ge=-5, le=180, description="Where it parks, encoder elevation.  Decides the same."
    )
    maintenance: list[MaintenanceSection] = Field(
        default=[], description="Times in which the station does not track, each a [[schedule.maintenance]] table."
    )

    def rules(self, azimuth: AxisLimits, elevation: AxisLimits, requests: tuple[PassRequest, ...] = ()) -> StationRules:
        windows = tuple(Window(one.from_utc, one.to_utc, one.reason) for one in self.maintenance)
        return StationRules(azimuth, elevation, self.pre_s, self.post_s, windows, requests)

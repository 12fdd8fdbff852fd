"""[hooks] and [wind] of station.toml: programs that are started at what happens, and when the wind stows."""

from typing import Literal

from pydantic import Field, field_validator, model_validator

from acu_daemon.config.section import Name, Section
from acu_daemon.edge.hooks import Hook
from acu_daemon.schedule.wind import WindRules

_RULES = WindRules()
Program = list[Name]


def _program(when: str) -> Program:
    """A key for a hook."""
    kind: Program = Field(
        default=[],
        json_schema_extra={"range": "a program and its arguments"},
        description=f"Started {when}, with JSON on its standard input.  Decides nothing of the pass.",
    )
    return kind


class HooksSection(Section):
    before_pass: Program = _program("when a pass is prepared, before its rise")
    during_pass: Program = _program("with before_pass and ended with the pass, such as a recorder")
    at_lock: Program = _program("when the signal is locked, each time")
    at_loss: Program = _program("when it is lost, each time")
    after_pass: Program = _program("when a pass is over, however it came out")
    on_no_go: Program = _program("when a pass cannot begin as things stand")
    on_alarm: Program = _program("when an alarm begins")
    before_move: Program = _program("before_move_s before the antenna moves unasked, such as a horn")
    time_limit_s: float = Field(
        default=30.0,
        ge=1,
        le=3600,
        description="After so long a program is killed, with all that it started.  Decides that; during_pass has none.",
    )
    before_move_s: float = Field(
        default=10.0,
        ge=0,
        le=300,
        description="How long before such a move the horn is started.  Decides how much earlier the antenna sets out.",
    )

    user: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a user of this machine"},
        description=(
            "As whom the programs are started, with all groups of that user; without it as the daemon's own user.  "
            "Decides what they may read, write and command."
        ),
    )

    @property
    def commands(self) -> dict[Hook, Program]:
        return {hook: getattr(self, str(hook)) for hook in Hook}


class WindSection(Section):
    udp: Name | None = Field(
        default=None,
        json_schema_extra={"range": "ADDRESS:PORT"},
        description=(
            "An address of this machine at which datagrams arrive: JSON with mean_m_s, gust_m_s, utc.  Decides whether "
            "the wind is watched."
        ),
    )
    file: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a path"},
        description="A file beside station.toml, or elsewhere, with the same JSON.  Decides the same.",
    )
    mean_limit_m_s: float = Field(
        default=_RULES.mean_limit_m_s,
        gt=0,
        le=60,
        description="A mean wind above it stows the antenna.  Decides when a pass is given up for the wind.",
    )
    gust_limit_m_s: float = Field(
        default=_RULES.gust_limit_m_s, gt=0, le=90, description="A gust above it does too.  Decides the same."
    )
    resume_share: float = Field(
        default=_RULES.resume_share,
        gt=0,
        le=1,
        description="Of both limits: below it the wind is calm again.  Decides when the antenna may move again.",
    )
    resume_after_s: float = Field(
        default=_RULES.resume_after_s, ge=0, le=86400, description="For so long it must be.  Decides the same."
    )
    max_age_s: float = Field(
        default=_RULES.max_age_s,
        ge=2,
        le=3600,
        description="A wind that is older is stale, which is told.  Decides when `when_stale` holds.",
    )
    when_stale: Literal["go_on", "stow"] = Field(
        default=_RULES.when_stale,
        description=(
            "What follows when the wind is stale and was calm; one that was strong counts as strong.  Decides whether "
            "a sensor that fails stows."
        ),
    )

    @field_validator("udp")
    @classmethod
    def _is_address(cls, value: str | None) -> str | None:
        if value is not None:
            host, _, port = value.rpartition(":")
            if not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
                raise ValueError("expected ADDRESS:PORT, such as 127.0.0.1:4841")
        return value

    @model_validator(mode="after")
    def _gusts_are_more(self) -> "WindSection":
        if self.gust_limit_m_s < self.mean_limit_m_s:
            raise ValueError(f"gust_limit_m_s = {self.gust_limit_m_s:g}: expected at least mean_limit_m_s")
        return self

    @property
    def is_watched(self) -> bool:
        return self.udp is not None or self.file is not None

    def rules(self) -> WindRules:
        return WindRules(**self.model_dump(exclude={"udp", "file"}))

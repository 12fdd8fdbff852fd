"""[receiver], [readings] and [tracking] of station.toml; a satellite's file may have its own values."""

from typing import Literal

from pydantic import Field, field_validator, model_validator

from acu_daemon.config.section import Name, Positive, Section
from acu_daemon.control.receiver_signal import MOST_DB, SignalRules

LEAST_LOW_WATER_S = 4.0  # a niced fit on a busy machine takes a second: less would end good ones (daemon.background)


class ReceiverSection(Section):
    beamwidth_deg: float = Field(
        default=1.0,
        gt=0,
        le=30,
        description=(
            "Full width of the beam at half power.  Decides what counts as on the path (half of it), when a hold is "
            "no longer sure, the rows of a search, and which readings are a side lobe's."
        ),
    )
    lock_dwell_s: float = Field(
        default=1.0,
        ge=0,
        le=60,
        description=(
            "How long the signal must be acquired before its readings count.  Decides how soon the first fit comes, "
            "and what a glimpse of signal is worth."
        ),
    )
    signal: Name | None = Field(
        default=None,
        json_schema_extra={"range": "`acu`, `none`, `udp://ADDRESS:PORT`"},
        description=(
            "Who says that the signal is there: the ACU, which follows it (autotrack), nobody, or a receiver beside it "
            "in UDP datagrams (docs/receivers.md), which can only deny what the ACU calls acquired.  Decides whether a "
            "pass is tracked by its signal or flown by program track, and what is told of lock and loss.  Left out: "
            "`acu` where the ACU has autotrack."
        ),
    )
    program_track: bool = Field(
        default=False,
        description=(
            "With `udp://`: the antenna is led along the prediction though the ACU has autotrack.  Decides whether "
            "anything is fitted: nothing is by program track."
        ),
    )
    signal_lock_db: float = Field(
        default=SignalRules().lock_db,
        ge=-MOST_DB,
        le=MOST_DB,
        description=(
            "With `udp://`, where the receiver tells a level alone: from here on it is locked, in the receiver's own "
            "dB.  Decides lock, loss and hold."
        ),
    )
    signal_unlock_db: float = Field(
        default=SignalRules().unlock_db,
        ge=-MOST_DB,
        le=MOST_DB,
        description="Below it it is locked no more; less than `signal_lock_db`.  Decides the same.",
    )

    @field_validator("signal")
    @classmethod
    def _is_source(cls, value: str | None) -> str | None:
        if value in (None, "acu", "none"):
            return value
        scheme, _, address = value.partition("://")
        host, _, port = address.rpartition(":")
        if scheme != "udp" or not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
            raise ValueError("expected acu, none, or udp://ADDRESS:PORT, such as udp://127.0.0.1:4842")
        return value

    @model_validator(mode="after")
    def _is_a_receiver(self) -> "ReceiverSection":
        self._must_be_below("signal_unlock_db", "signal_lock_db")
        if self.program_track and self.signal_udp is None:
            raise ValueError(
                'program_track = true: expected signal = "udp://ADDRESS:PORT"; with "none" it is so anyway'
            )
        return self

    @property
    def signal_udp(self) -> str | None:
        """ADDRESS:PORT of this machine to which a receiver sends; None: none does."""
        return self.signal.removeprefix("udp://") if self.signal and self.signal.startswith("udp://") else None

    def signal_rules(self) -> SignalRules | None:
        """How what it sends is judged; None: none does."""
        return None if self.signal_udp is None else SignalRules(self.signal_lock_db, self.signal_unlock_db)


class ReadingsSection(Section):
    sigma_azimuth_deg: Positive = Field(
        default=0.05,
        description=(
            "Noise of a reading in azimuth, across the elevation (times cos(el)), 1 sigma.  Decides how soon a fit "
            "leaves its prior, and the size of its ellipses."
        ),
    )
    sigma_elevation_deg: Positive = Field(default=0.05, description="The same in elevation.  Decides the same.")
    bias_sigma_azimuth_deg: float = Field(
        default=0.1,
        ge=0,
        description=(
            "How far the azimuth encoder may be off, 1 sigma, not times cos(el); 0: exactly aligned.  Decides what "
            "`full` takes for a bias: it limits its first minute."
        ),
    )
    bias_sigma_elevation_deg: float = Field(default=0.1, ge=0, description="The same in elevation.  Decides the same.")
    bias_sigma_azimuth_sec_deg: float = Field(
        default=0.003,
        ge=0,
        description="A part that grows with 1 / cos(el): axes that are not square.  Decides the same.",
    )
    bias_sigma_elevation_cot_deg: float = Field(
        default=0.0,
        ge=0,
        description=(
            "A part that grows with cot(el): an antenna that sags; where there is air, 0.08 of its refraction is "
            "added.  Decides the same; costs accuracy where the antenna does not sag (docs/accuracy.md)."
        ),
    )


class TrackingSection(Section):
    horizon_s: float = Field(
        default=90.0,
        ge=10,
        le=600,
        description=(
            "How far ahead of now the prediction buffer reaches.  Decides how long the antenna is led when nothing "
            "refills the buffer, and how far `prediction good for` can look."
        ),
    )
    low_water_s: float = Field(
        default=30.0,
        le=500,
        json_schema_extra={"range": "4 to 500, below horizon_s"},
        description=(
            "The buffer is made anew when less than this is left.  Decides how long the fit process may take: half of "
            "it, 5 s at most; the other half is for a buffer made without it."
        ),
    )
    max_fit_elevation_deg: float = Field(
        default=80.0,
        gt=0,
        le=90,
        description=(
            "Readings above it are not fitted: the azimuth drive lags near the zenith.  Decides what an overhead pass "
            "adds to the fit."
        ),
    )
    estimator: Literal["circular", "deterministic", "kalman", "full"] = Field(
        default="full",
        description=(
            "How the orbit is fitted (docs/estimation.md): `full`, or one of the papers' three.  Decides how good a "
            "hold is, and whether its sigma is known."
        ),
    )
    preposition_s: float = Field(
        default=120.0,
        ge=10,
        le=3600,
        description=(
            "At least so long before the rise the antenna sets out, earlier where its way takes longer.  Decides when "
            "it begins to move."
        ),
    )
    zenith_takeover: Literal["fitted", "always", "never"] = Field(
        default="fitted",
        description=(
            "Whether the daemon takes the antenna out of autotrack where its azimuth drive cannot follow over the "
            "zenith, leads it past, and gives it back (docs/pass-plan.md): with a fit of this pass, always, or never.  "
            "Decides how much of an overhead pass is lost."
        ),
    )
    leave_false_lock: bool = Field(
        default=False,
        description=(
            "Whether a lock of autotrack far off a good fit (a side lobe, another satellite, the sun) is left: REMOTE "
            "back onto the prediction, and autotrack again from there.  Decides whether a false lock lasts."
        ),
    )
    false_lock_s: float = Field(
        default=3.0,
        ge=1,
        le=60,
        description="How long it must be off without a break.  Decides how soon it is left.",
    )
    zenith_objective: Literal["largest_error", "seconds"] = Field(
        default="largest_error",
        description=(
            "What a pass near the zenith loses least of where the azimuth drive is too slow (docs/pass-plan.md): the "
            "largest error of the beam, or seconds out of it, with errors up to 1.9 times larger, all on one side.  "
            "Decides when the antenna leaves the path."
        ),
    )
    search_along_s: Positive = Field(
        default=10.0,
        description=(
            "Seconds early and late that a search covers first; 3 sigma of the prediction come after, to 120 s.  "
            "Decides how long it takes until a search looks elsewhere."
        ),
    )
    search_across_deg: Positive = Field(
        default=2.0,
        description=(
            "Degrees to the right and left of the path that a search covers first, 3 sigma after, to 10 deg.  Decides "
            "the same."
        ),
    )

    @model_validator(mode="after")
    def _water_below_horizon(self) -> "TrackingSection":
        if self.low_water_s < LEAST_LOW_WATER_S:
            raise ValueError(
                f"low_water_s = {self.low_water_s:g}: expected at least {LEAST_LOW_WATER_S:g}, of which half is for an "
                "answer of the fit process, also one that starts, and half for a buffer made without it"
            )
        self._must_be_below("low_water_s", "horizon_s")
        return self

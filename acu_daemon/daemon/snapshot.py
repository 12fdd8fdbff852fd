"""The snapshot: everything people look at, at one instant.  Live line, status and the watchdog's food come from it.

daemon.taking makes it of what there is; daemon.verdict says in a word what it amounts to.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from acu_daemon.model import Pass


@dataclass(frozen=True, slots=True)
class StationFacts:
    """What a station adds to what is shown of a run."""

    wind: str = ""
    phantom: str = ""
    paused_until_utc: str = ""


@dataclass(frozen=True, slots=True)
class Subject:
    """What a run is about."""

    satellite: str = ""
    station: str = ""
    acu: str = ""
    coming: Pass | None = None
    elements: str = ""
    elements_problem: str = ""
    next_passes: tuple[str, ...] = ()
    facts: StationFacts = StationFacts()


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything people look at, at one instant.  docs/status.md tells each key."""

    tai_s: float
    state: str
    az_deg: float | None
    el_deg: float | None
    reading_age_s: float | None
    command_az_deg: float | None
    command_el_deg: float | None
    agc_db: float | None
    is_acquired: bool
    miss_deg: float | None  # reading against the prediction, on the sky; only while acquired
    along_s: float | None
    across_deg: float | None
    fit_age_s: float | None
    sigma_deg: float | None  # of the predicted direction now
    inside_s: float | None  # until 3 sigma leave the half-power beam; the buffer's length where they do not
    buffer_s: float
    buffer_kind: str
    lag_az_s: float
    lag_el_s: float
    tick_count: int
    skipped_tick_count: int
    write_count: int
    refusal_count: int
    is_link_up: bool
    link_problem: str
    is_rehearsal: bool
    is_simulation: bool
    lateness_p50_ms: float = 0.0  # of the newest ticks
    lateness_p99_ms: float = 0.0
    lateness_max_ms: float = 0.0
    answered_count: int = 0  # ordered exchanges that the ACU answered
    attempt_count: int = 0  # to open the link
    model: str = ""  # what the prediction is made from
    arming: str = "armed"  # "disarmed", "shadow"
    disarmed_by: str = ""
    latch: str = ""  # what an axis did wrong; cleared by a person
    stow_by: str = ""  # whose the stow is that keeps the antenna: wind, operator, panel, schedule
    stow_alarm: str = ""  # that a stow is wanted, and why it is not carried out
    is_held_by_person: bool = False  # autotrack is left for the prediction
    nudge_along_s: float = 0.0  # what a person moves the path by: late, right positive
    nudge_across_deg: float = 0.0
    encoder_problem: str = ""
    clock_alarm: str = ""
    line_alarm: str = ""
    turn_alarm: str = ""  # an azimuth that does not come to its goal, a sector bit that is wrong
    files_alarm: str = ""  # what cannot be written: recording, state
    limit_alarm: str = ""  # which axis is held at its limit: the satellite is beyond it
    limited_count: int = 0  # writes that were held at a limit
    clamped_count: int = 0  # followed writes that the register limiter held back to what the axes can do
    search: str = ""  # what SEARCH has covered so far
    false_lock_count: int = 0  # locks that were left because they were not the satellite's
    rejecting: str = ""  # why the newest readings are not fitted
    rejected_counts: dict[str, int] = field(default_factory=dict)  # readings so far, by reason
    utc: str = ""
    satellite: str = ""
    station: str = ""
    acu: str = ""
    elements: str = ""  # kind and epoch of what the satellite is tracked by
    elements_problem: str = ""  # why no newer ones come
    verdict: str = ""  # daemon.verdict
    state_s: float | None = None  # since the state began
    off_path_deg: float | None = None  # where the antenna points beside the path (control.tracking.off_path)
    is_on_path: bool | None = None  # by no more than half the beam
    path: str = ""  # what that path is made from
    half_beam_deg: float | None = None
    speed_deg_s: float | None = None  # measured, on the sky
    acu_mode: str = ""
    acu_faults: str = ""  # as the ACU named them
    is_stopping: bool = False  # a STOP was sent and is not acknowledged
    stop_sent_utc: str = ""  # when the newest STOP went out
    stop_confirmed_utc: str = ""  # when the ACU acknowledged it
    rise_utc: str = ""
    set_utc: str = ""
    rise_in_s: float | None = None  # negative: the pass has begun
    set_in_s: float | None = None
    culmination_deg: float | None = None
    next_passes: tuple[str, ...] = ()  # after this one: satellite, rise, highest elevation, for people
    wind: str = ""  # what is known of it, where it is watched
    phantom: str = ""  # what the phantom pass has found of the next pass, or of this one
    paused_until_utc: str = ""  # no pass is begun until then
    tilt: str = ""  # how the pedestal leans, and how it should; where it has a tilt that is moved
    tilt_alarm: str = ""  # the satellite is up, and the pedestal does not lean as the pass asks: no path is true
    zenith: str = ""  # what crossing it is expected to cost, until it is past
    sun_deg: float | None = None  # between boresight and sun; None where sun_policy is off
    sun_reach_s: float | None = None  # until the sun's keep-out is where the antenna stands; None: not within an hour
    way_out_az_deg: float | None = None  # where it could stand clear of the sun
    way_out_el_deg: float | None = None
    envelope_alarm: str = ""  # an antenna that the daemon may not move, or does not, before a keep-out
    is_hidden: bool = False  # the path is behind the mask, and nothing is heard
    hidden_s: float | None = None  # until it comes out again, while it is
    slaved_by: str = ""  # which program leads the antenna
    slaved_s: float | None = None  # until it does no more, unless it says a direction before
    signal_db: float | None = None  # as a receiver beside the ACU said last
    signal_age_s: float | None = None  # since it said it
    signal_lost_s: float | None = None  # since it lost a lock of this pass
    signal_alarm: str = ""  # it says nothing
    is_told_of_signal: bool = True  # by the ACU or a receiver beside it


def snapshot_of(values: Mapping[str, Any]) -> Snapshot:
    """The snapshot that a daemon's JSON tells; what a newer one tells more is left out.

    Raises: TypeError: something is missing.
    """
    known = {one.name for one in fields(Snapshot)}
    return Snapshot(**{name: value for name, value in values.items() if name in known})

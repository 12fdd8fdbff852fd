"""The newest status, and where it shows the antenna.  Owner of `Intake` and of the encoders' watch.  Pure."""

from dataclasses import replace

from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.orders import Event
from acu_daemon.control.safety.encoder_watch import EncoderWatch, watch_encoders
from acu_daemon.control.state import ControlState, Intake
from acu_daemon.control.tick_input import Sky, TickInput
from acu_daemon.control.tracking.causes import is_acquired
from acu_daemon.control.tracking.state_table import AUTOTRACKING
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Reading

RATE_READINGS = 6  # the rate of an axis is taken over this many readings: near the zenith one pair is all noise


def take_status(
    state: ControlState, status: AcuStatus, reading: Reading, az_deg: float, given: TickInput, events: list[Event]
) -> ControlState:
    """Remember a status and its reading, and watch the encoders.  az_deg: where the azimuth is, continuous."""
    before = state.intake
    intake = Intake(
        status=status,
        reading=reading,
        is_place_sure=given.seen.is_confirmed,
        az_deg=az_deg,
        track_of_readings=(*before.track_of_readings[1 - RATE_READINGS :], (reading.tai_s, az_deg, status.el_deg)),
    )
    encoders = _watched(state, status, reading, given.sky, events) if given.seen.is_in_step else state.encoders
    return with_parts(state, intake=intake, encoders=encoders)


def shift_places(state: ControlState, shift_deg: float) -> ControlState:
    """Put the azimuth on another turn: by a multiple of 360 deg further on."""
    intake = state.intake
    readings = tuple((tai_s, az + shift_deg, el) for tai_s, az, el in intake.track_of_readings)
    return with_parts(state, intake=replace(intake, az_deg=intake.az_deg + shift_deg, track_of_readings=readings))


def doubt_place(state: ControlState) -> ControlState:
    """After a lost link nobody knows where the antenna is, until some readings agree."""
    return with_parts(state, intake=replace(state.intake, is_place_sure=False))


def _watched(state: ControlState, status: AcuStatus, reading: Reading, sky: Sky, events: list[Event]) -> EncoderWatch:
    """Watch for frozen encoders while autotrack holds the satellite."""
    is_ours = is_acquired(status) and state.tracking.track in AUTOTRACKING
    path = sky.prediction.at(reading.tai_s) if sky.prediction and is_ours else None
    path = path if path is not None and path.is_finite else None
    watch = watch_encoders(state.encoders, reading.tai_s, status, path)
    if watch.problem and not state.encoders.problem:
        events.append(Event("encoder.frozen", {"problem": watch.problem, "action": "not fitted"}, is_warning=True))
    elif state.encoders.problem and not watch.problem:
        events.append(Event("encoder.moves"))
    return watch

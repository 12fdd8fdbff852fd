"""What a success clears: after trouble and enough good ticks the memory is that of a run without the trouble."""

from collections.abc import Callable
from dataclasses import fields, replace
from math import nan

import numpy as np
import pytest
from fake_sky import AZIMUTH, ELEVATION
from memories import Judge, remembering

from acu_daemon.acu.commands import (
    AcuMode,
    Backup,
    Command,
    Identify,
    PointAndPoll,
    PointAt,
    Poll,
    ReadCommanded,
    ReadTurnChoice,
    ReadWatchdog,
)
from acu_daemon.acu.replies import AcuStatus, Commanded, Done, Refused, Reply, TurnChoice, WatchdogTime
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.axis_watch import AWAY_S, AxesWatch, AxisSeen, Bounds, Duty, watch_axes
from acu_daemon.control.safety.encoder_watch import EncoderWatch, watch_encoders
from acu_daemon.control.safety.status_plausibility import CONTRADICTING_COUNT, MOVED_COUNT
from acu_daemon.control.safety.turn import AGAINST_COUNT, BIT_SCORE, TurnWatch, locate, watch_pull
from acu_daemon.control.startup import WATCHDOG_TRY_S, after_reply
from acu_daemon.control.state import ControlState, StartStage, Watchdog
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, PassPlan, Sky, TickInput
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.drivers.sa3842.messages import Identity
from acu_daemon.drivers.sa3842.sa3842_driver import field_reply
from acu_daemon.model import Correction, FitResult, Pointing, Prediction, Reading
from acu_daemon.pointing.envelope import Envelope

CONFIG = ControlConfig(Envelope(AZIMUTH, ELEVATION))
NOW, PERIOD_S = 8.4e8, 0.1
BEGIN, TICKS = 20, 320
CODE_DEG = 360.0 / 65536.0
PLAN = PassPlan(NOW - 100.0, NOW + 500.0, NOW - 100.0, 150.0, 5.0)
FIT = FitResult("full", Correction(), NOW, 100, 0, 0.01, 0.2, 0.1)
COUNTED = {"refusal_count", "clamped_count", "limited_count"}  # for people: they stay
TOLD = {"refused_tai_s", "refused_until_tai_s", "limited_tai_s", "again_tai_s", "command"}  # when it was
OF_A_LOSS = {"entered_tai_s", "hold_from_tai_s", "acquired_since_tai_s", "az", "el"}
OF_A_START = {"entered_tai_s", "present_deg", "acquired_since_tai_s", "identity", "is_identity_sure"}


def fitted() -> Prediction:
    t = PERIOD_S * np.arange(-100, 700)
    az, el = 150.0 + 0.8 * t, 50.0 - 0.3 * t
    az_rate, el_rate = np.full(t.size, 0.8), np.full(t.size, -0.3)
    return Prediction(NOW - 10.0, PERIOD_S, az, el, az_rate, el_rate, az, az_rate, "FITTED", NOW)


SKY = Sky(fitted(), FIT, PLAN)


def good(k: int) -> AcuStatus:
    """Autotrack on the path, at the time of the reading."""
    s = PERIOD_S * k - 0.09
    az, el = (round(one / CODE_DEG) * CODE_DEG for one in (150.0 + 0.8 * s, 50.0 - 0.3 * s))
    return AcuStatus(
        *(az, el, AcuMode.AUTOTRACK),
        backup_selected=Backup.REMOTE,
        is_autotrack_selected=True,
        is_acquired=True,
        is_sector_high=True,
    )


def reply_to(command: Command, written: tuple[float, float]) -> Reply:
    match command:
        case Identify():
            return field_reply(Identity("3842", "01"))
        case ReadCommanded():
            return Commanded(written[0] % 360.0, written[1])
        case ReadTurnChoice():
            return TurnChoice(is_nearest=True)
        case ReadWatchdog():
            return WatchdogTime(0.0)
    return Done()


Change = Callable[[Observation, Sky, int], tuple[Observation, Sky]]


def run(change: Change | None, lasts: int) -> tuple[ControlState, list[str]]:
    """The memory after TICKS ticks; the trouble begins at BEGIN and lasts so many."""
    first = good(0)
    state = remembering(
        track=TrackState.AUTOTRACK_FITTED,
        entered_tai_s=NOW - 50.0,
        stage=StartStage.READY,
        status=first,
        az_deg=first.az_deg,
    )
    extra, written, names = None, (first.az_deg, first.el_deg), []
    for k in range(TICKS):
        now, status = NOW + PERIOD_S * k, good(k)
        reading = Reading(now - 0.09, status.az_deg, status.el_deg, True)
        seen, sky = Observation(reading, status, extra=extra), SKY
        if change is not None and BEGIN <= k < BEGIN + lasts:
            seen, sky = change(seen, sky, k)
        state, orders = tick(state, TickInput(seen, sky, now), CONFIG)
        names += [event.name for event in orders.events]
        for command in (orders.first, orders.extra):
            if isinstance(command, PointAndPoll | PointAt):
                written = command.az_deg, command.el_deg
        asked = orders.extra or (None if isinstance(orders.first, Poll | PointAndPoll) else orders.first)
        extra = None if asked is None else Exchange(asked, reply_to(asked, written))
    return state, names


def lost(seen: Observation, sky: Sky, k: int) -> tuple[Observation, Sky]:
    return Observation(silence_s=PERIOD_S * (k - BEGIN), must_poll=True), sky


def shown(**changes: object) -> Change:
    """A status with some fields changed."""

    def change(seen: Observation, sky: Sky, _k: int) -> tuple[Observation, Sky]:
        status = replace(seen.status, **changes)
        reading = replace(seen.reading, az_deg=status.az_deg, el_deg=status.el_deg, is_locked=status.is_acquired)
        return replace(seen, status=status, reading=reading), sky

    return change


def given(**changes: object) -> Change:
    return lambda seen, sky, _k: (replace(seen, **changes), sky)


def under(**changes: object) -> Change:
    return lambda seen, sky, _k: (seen, replace(sky, **changes))


LOSS = shown(mode=AcuMode.REMOTE_BACKUP, is_acquired=False)
ABOVE = replace(fitted(), el_deg=fitted().el_deg + 60.0)
TROUBLES: dict[str, tuple[Change, int, set[str]]] = {
    "a refused write": (given(refused=Refused(), status=None, reading=None), 1, set()),
    "refused writes": (given(refused=Refused(), status=None, reading=None), 20, set()),
    "two lost replies": (lost, 3, set()),
    "a lost link": (lost, 20, OF_A_START),
    "polls": (given(must_poll=True), 10, set()),
    "replies out of step": (given(is_in_step=False), 10, set()),
    "places that are not confirmed": (given(is_confirmed=False), 10, set()),
    "a line without room": (given(has_room=False), 10, set()),
    "angles that are no numbers": (shown(az_deg=nan), 5, set()),
    "a prediction of no numbers": (under(prediction=replace(fitted(), el_deg=fitted().el_deg * nan)), 10, set()),
    "a plan of no numbers": (under(plan=replace(PLAN, set_tai_s=nan)), 10, set()),
    "a fit of no numbers": (under(fit=replace(FIT, along_s=nan)), 10, set()),
    "a path above the limits": (under(prediction=ABOVE), 10, set()),
    "a frozen azimuth": (shown(az_deg=good(BEGIN).az_deg), 10, set()),
    "a frozen elevation": (shown(el_deg=good(BEGIN).el_deg), 10, set()),
    "a wild azimuth": (shown(az_deg=10.0), 1, set()),
    "wild azimuths": (shown(az_deg=10.0), 4, set()),
    "a wrong sector bit": (shown(is_sector_high=False), 4, set()),
    "a sector bit wrong for long": (shown(is_sector_high=False), 40, set()),
    "limit switches": (shown(is_at_up_limit=True, is_at_ccw_limit=True), 10, set()),
    "a loss": (LOSS, 15, OF_A_LOSS),
    "a backup that is lost": (shown(backup_selected=Backup.RATE), 5, OF_A_START),
    "the local panel": (shown(is_remote_enabled=False), 10, OF_A_LOSS | OF_A_START),
    "a fault": (shown(mode=AcuMode.FAULT, is_acquired=False, has_azimuth_fault=True), 10, OF_A_LOSS),
}


@pytest.mark.long
@pytest.mark.parametrize("trouble", TROUBLES)
def test_after_good_ticks_the_memory_is_that_of_a_run_without_the_trouble(trouble: str) -> None:
    change, lasts, stays = TROUBLES[trouble]
    (plain, names), (after, names_after) = run(None, 0), run(change, lasts)
    assert names == []
    parts = [(getattr(plain, part.name), getattr(after, part.name)) for part in fields(ControlState)]
    different = {
        field.name
        for one, other in parts
        for field in fields(one)
        if getattr(one, field.name) != getattr(other, field.name)
    }
    assert different <= COUNTED | TOLD | stays, names_after


# Trouble that is over does not add up with the next


@pytest.mark.parametrize("bad", range(1, CONTRADICTING_COUNT))
def test_doubtful_statuses_add_up_only_in_a_row(bad: int) -> None:
    doubt, right = Judge(AZIMUTH, ELEVATION), good(0)
    wrong, k, believed = replace(right, contradictions=("mode and backup",)), 0, []
    doubt.believes(right, NOW)
    for _ in range(5):
        for status in (*[wrong] * bad, right):
            k += 1
            believed.append((doubt.believes(status, NOW + 0.1 * k), status is right))
    assert all(is_believed == is_right for is_believed, is_right in believed)
    jumped = replace(right, az_deg=(right.az_deg + 90.0) % 360.0)
    for status in [jumped] * (MOVED_COUNT - 1) + [right] + [jumped] * (MOVED_COUNT - 1):
        k += 1
        assert doubt.believes(status, NOW + 0.1 * k) == (status is right)


def test_wild_azimuths_and_wrong_bits_add_up_only_without_good_ones_between() -> None:
    watch, az_deg = TurnWatch(), 260.0  # a bearing of 300 deg is reached on the other turn alone
    at = AcuStatus(260.0, 40.0, AcuMode.REMOTE, is_sector_high=True)
    for _ in range(6):
        for status in [replace(at, az_deg=300.0)] * (AGAINST_COUNT - 2) + [at]:
            watch, az_deg = locate(watch, status, AZIMUTH, az_deg)
            assert az_deg >= 260.0
        assert watch.against_count == 0
    for _ in range(6):
        for status in [replace(at, is_sector_high=False)] * (BIT_SCORE // 2 - 1) + [at] * BIT_SCORE:
            watch, az_deg = locate(watch, status, AZIMUTH, az_deg)
        assert (watch.wrong_half, watch.bit_score) == (None, 0)


def test_a_pull_that_ends_is_forgotten() -> None:
    watch = TurnWatch()
    for k in range(40):
        watch, is_for_good = watch_pull(watch, NOW + 0.1 * k, 20.0 * k, 20.0, AZIMUTH, scale=1.0, is_pulled=k % 5 != 4)
        assert not is_for_good


@pytest.mark.parametrize("axis", ["az", "el"])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("duty", [Duty.FOLLOW, Duty.STAND])
def test_p6_an_axis_that_is_wrong_for_a_while_and_right_again_is_not_found_wrong_for_both(
    axis: str, side: int, duty: Duty
) -> None:
    watch, bounds = AxesWatch(), Bounds()
    is_bad_s = (AWAY_S if duty is Duty.FOLLOW else bounds.error_s) - 0.2
    for k in range(200):
        since_s = 0.1 * (k % 29)
        off_deg = side * 1.5 if 1.0 <= since_s < 1.0 + is_bad_s else 0.0
        seen = AxisSeen(NOW + 0.1 * k, 20.0 + off_deg, 0.0, duty, -off_deg if duty is Duty.FOLLOW else None)
        calm = replace(seen, angle_deg=20.0, gap_deg=0.0)
        pair = (seen, calm) if axis == "az" else (calm, seen)
        watch, problem = watch_axes(watch, good(0), *pair, (AZIMUTH, ELEVATION), bounds)
        assert problem == ""


@pytest.mark.parametrize("rates_deg_s", [(0.6, 0.0), (-0.6, 0.0), (0.0, 0.6), (0.0, -0.6)])
def test_an_encoder_that_moved_in_between_is_not_frozen(rates_deg_s: tuple[float, float]) -> None:
    watch, path = EncoderWatch(), Pointing(0.0, 10.0, *rates_deg_s)
    for k in range(100):
        status = replace(good(0), az_deg=100.0 + CODE_DEG * (k // 2), el_deg=10.0 + CODE_DEG * (k // 2))
        watch = watch_encoders(watch, NOW + 0.1 * k, status, path)
        assert watch.problem == ""


def test_tries_of_the_register_watchdog_that_an_answer_ended_do_not_count_for_the_next() -> None:
    config = replace(CONFIG, register_watchdog_s=2.0)
    state, now = remembering(stage=StartStage.READY, status=good(0)), NOW
    for _ in range(3):
        for share in (0.0, 0.9):
            silent = Exchange(ReadWatchdog(), None)
            state = after_reply(state, silent, now + share * WATCHDOG_TRY_S, config, [])
            assert state.startup.watchdog is Watchdog.UNKNOWN
        answered = Exchange(ReadWatchdog(), WatchdogTime(2.0))
        state = after_reply(state, answered, now + 0.95 * WATCHDOG_TRY_S, config, [])
        assert state.startup.watchdog is Watchdog.SET
        state, now = remembering(state, watchdog=Watchdog.UNKNOWN), now + 10.0


def test_writes_refused_now_and_then_are_not_paused() -> None:
    def change(seen: Observation, sky: Sky, k: int) -> tuple[Observation, Sky]:
        return (replace(seen, refused=Refused()), sky) if (k - BEGIN) % 25 == 0 else (seen, sky)

    after, _ = run(change, 250)
    assert after.registers.refused_until_tai_s <= after.registers.refused_tai_s
    assert after.registers.refused_tai_s > NOW + 20.0

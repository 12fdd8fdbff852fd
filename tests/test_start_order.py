"""The order of a start against a small ACU: nothing is written before the present angles, and those are read back."""

from dataclasses import replace
from itertools import product
from typing import Any

import pytest
from memories import remembering

from acu_daemon.acu.commands import (
    READS,
    AcuMode,
    Backup,
    Command,
    FreeTurnChoice,
    Identify,
    PointAt,
    ReadCommanded,
    ReadFaults,
    ReadTurnChoice,
    ReadWatchdog,
    SelectBackup,
    SelectMode,
    SetWatchdog,
    Stop,
)
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Commanded, Done, Refused, Reply, TurnChoice, WatchdogTime
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.arming import last_command
from acu_daemon.control.startup import after_reply, next_command, watch_for_power_cycle
from acu_daemon.control.state import ControlState, StartStage, Watchdog
from acu_daemon.control.tick_input import Exchange
from acu_daemon.drivers.sa3842.angles import LSB_DEG
from acu_daemon.drivers.sa3842.field_status import read_field_status
from acu_daemon.drivers.sa3842.messages import Identity
from acu_daemon.drivers.sa3842.sa3842_driver import field_reply
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.envelope import Envelope

CONFIG = ControlConfig(Envelope(AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
AZ_DEG, EL_DEG = 22464 * LSB_DEG, 10322 * LSB_DEG  # angles an encoder can show, near 123.4 and 56.7
NOW = 1000.0  # TAI


class SmallAcu:
    """Answers what a start asks; refuses or stays silent where the test says."""

    def __init__(self, sector: int = 0, registers: tuple[float, float] = (10.0, 20.0)) -> None:
        self.sector, self.registers, self.count = sector, registers, 0
        self.asked: list[Command] = []

    def answer(self, command: Command) -> Reply:
        self.asked.append(command)
        match command:
            case Identify():
                return field_reply(Identity("3842", "S2"))
            case ReadCommanded():
                az_deg, el_deg = (round(angle / LSB_DEG) * LSB_DEG for angle in self.registers)
                return Commanded(az_deg % 360.0, el_deg)
            case ReadTurnChoice():
                return TurnChoice(is_nearest=self.sector == 0)
            case FreeTurnChoice():
                self.sector = 0
                return Done()
            case PointAt(az_deg=az_deg, el_deg=el_deg):
                self.registers, self.count = (az_deg, el_deg), self.count + 1
                return Done()
        return Refused()


def status(**changes: object) -> AcuStatus:
    standby = read_field_status("0" * 23)
    return replace(
        standby,
        mode=AcuMode.STANDBY,
        az_deg=AZ_DEG,
        el_deg=EL_DEG,
        is_remote_enabled=True,
        **changes,  # type: ignore[arg-type]
    )


def standing(az_deg: float = AZ_DEG, el_deg: float = EL_DEG, *, is_remote_enabled: bool = True) -> ControlState:
    seen = replace(status(), az_deg=az_deg % 360.0, el_deg=el_deg, is_remote_enabled=is_remote_enabled)
    return remembering(status=seen, az_deg=az_deg, is_place_sure=True)


def step(state: ControlState, reply: Reply | None, command: Command) -> ControlState:
    return remembering(after_reply(state, Exchange(command, reply), NOW, CONFIG, []), command=command)


def start(state: ControlState, acu: SmallAcu, config: ControlConfig = CONFIG, limit: int = 20) -> ControlState:
    """Exchange until the start waits or is done."""
    for _ in range(limit):
        command = next_command(state, config)
        if command is None:
            return state
        state = step(state, acu.answer(command), command)
    return state


def test_p1_a_start_polls_identifies_reads_writes_the_present_angles_and_reads_them_back() -> None:
    acu = SmallAcu()
    state = start(standing(), acu)
    assert acu.asked == [
        *(Identify(), ReadCommanded(), ReadTurnChoice()),
        *(PointAt(AZ_DEG, EL_DEG), ReadCommanded()),
    ]
    assert state.startup.stage is StartStage.READY
    assert acu.registers == (AZ_DEG, EL_DEG)


def test_a_sector_preference_left_by_somebody_is_freed_first() -> None:
    acu = SmallAcu(sector=2)
    assert start(standing(), acu).startup.stage is StartStage.READY
    assert acu.sector == 0
    assert acu.asked.index(FreeTurnChoice()) < acu.asked.index(PointAt(AZ_DEG, EL_DEG))


def test_disarmed_it_stops_before_the_first_write() -> None:
    acu = SmallAcu(sector=2)
    state = start(standing(), acu, replace(CONFIG, is_armed=False))
    assert state.startup.stage is StartStage.REGISTERS_KNOWN
    assert all(isinstance(command, READS) for command in acu.asked)
    assert (acu.count, acu.sector) == (0, 2)


def test_under_local_control_it_waits_before_the_first_write() -> None:
    acu = SmallAcu()
    state = start(standing(is_remote_enabled=False), acu)
    assert state.startup.stage is StartStage.REGISTERS_KNOWN
    assert acu.count == 0
    remote = remembering(state, status=status())
    assert start(remote, acu).startup.stage is StartStage.READY


def test_p1_the_present_angles_of_a_single_status_are_not_written() -> None:
    acu = SmallAcu()
    state = start(remembering(standing(), is_place_sure=False), acu)
    assert (state.startup.stage, acu.count) == (StartStage.SECTOR_FREE, 0)
    assert start(remembering(state, is_place_sure=True), acu).startup.stage is StartStage.READY


def test_p1_without_any_status_nothing_is_written() -> None:
    acu = SmallAcu()
    assert start(ControlState(), acu).startup.stage is StartStage.REGISTERS_KNOWN
    assert acu.count == 0


@pytest.mark.parametrize(
    ("standing_deg", "written_deg"), [((300.0, 95.0), (270.0, 90.0)), ((-271.0, -0.5), (-270.0, 0.0))]
)
def test_an_antenna_outside_its_limits_is_asked_to_the_limit(
    standing_deg: tuple[float, float], written_deg: tuple[float, float]
) -> None:
    acu = SmallAcu()
    assert start(standing(*standing_deg), acu).startup.stage is StartStage.READY
    assert acu.registers == pytest.approx(written_deg, abs=LSB_DEG)
    assert is_inside(*acu.registers)


def is_inside(az_deg: float, el_deg: float) -> bool:
    return (
        CONFIG.azimuth.min_deg <= az_deg <= CONFIG.azimuth.max_deg
        and CONFIG.elevation.min_deg <= el_deg <= CONFIG.elevation.max_deg
    )


@pytest.mark.parametrize("az_deg", [0.0, -0.001, 359.999, -179.9, 180.0])
def test_the_read_back_holds_through_north_and_at_any_turn(az_deg: float) -> None:
    wide = replace(CONFIG, envelope=replace(CONFIG.envelope, azimuth=AxisLimits(-400.0, 400.0, 20.0, 10.0)))
    assert start(standing(az_deg), SmallAcu(), wide).startup.stage is StartStage.READY


def test_registers_that_another_hand_changed_are_written_again() -> None:
    class Meddled(SmallAcu):
        def answer(self, command: Command) -> Reply:
            reply = super().answer(command)
            if isinstance(command, PointAt) and self.count == 1:
                self.registers = (0.0, 0.0)
            return reply

    acu = Meddled()
    assert start(standing(), acu).startup.stage is StartStage.READY
    assert acu.count == 2


@pytest.mark.parametrize("lost", range(5))
def test_a_lost_reply_at_any_step_only_repeats_that_step(lost: int) -> None:
    acu = SmallAcu(sector=1 if lost == 3 else 0)
    state, exchange_count = standing(), 0
    while (command := next_command(state, CONFIG)) is not None and exchange_count < 20:
        reply = acu.answer(command)
        state = step(state, None if exchange_count == lost else reply, command)
        exchange_count += 1
    assert state.startup.stage is StartStage.READY
    assert exchange_count <= 8
    first_write = next(i for i, command in enumerate(acu.asked) if isinstance(command, PointAt))
    assert all(isinstance(command, (*READS, FreeTurnChoice)) for command in acu.asked[:first_write])


def test_a_refused_write_never_counts_as_done() -> None:
    class Refusing(SmallAcu):
        def answer(self, command: Command) -> Reply:
            if isinstance(command, PointAt):
                self.asked.append(command)
                return Refused()
            return super().answer(command)

    assert start(standing(), Refusing()).startup.stage is StartStage.SECTOR_FREE


def test_a_reply_to_another_question_moves_nothing() -> None:
    for stage in StartStage:
        state = remembering(standing(), stage=stage)
        assert after_reply(state, Exchange(ReadFaults(), TurnChoice(is_nearest=True)), NOW, CONFIG, []) == state
        assert after_reply(state, Exchange(Identify(), Refused()), NOW, CONFIG, []) == state


def test_when_it_is_ready_it_asks_for_nothing() -> None:
    assert next_command(remembering(standing(), stage=StartStage.READY), CONFIG) is None


LATCHED = remembering(problem="azimuth stands still away from its command", is_stop_due=True)


@pytest.mark.parametrize(
    ("identities", "stage"),
    [
        (["S1"], StartStage.IDENTIFIED),
        (["10"], StartStage.NEW),
        (["S9"], StartStage.NEW),
        (["S9", "S9"], StartStage.IDENTIFIED),
        (["S9", "10"], StartStage.NEW),
        (["10", "10"], StartStage.NEW),
    ],
)
def test_a_rehearsal_gets_on_only_with_an_acu_that_surely_is_simulated(
    identities: list[str], stage: StartStage
) -> None:
    state, config = LATCHED, replace(CONFIG, is_rehearsal=True)
    for variant in identities:
        state = after_reply(state, Exchange(Identify(), field_reply(Identity("3842", variant))), NOW, config, [])
    assert state.startup.stage is stage
    wanted = Stop() if stage is StartStage.IDENTIFIED else None
    assert last_command(remembering(state, status=status()), config) == wanted


# Every reply to everything, at every stage

NOW_S, WATCHED = 8.4e8, replace(CONFIG, register_watchdog_s=2.0)
SIMULATED, UNKNOWN = AcuIdentity("a", True, True), AcuIdentity("b", False, True)
ASKED = (
    *(Identify(), ReadCommanded(), ReadTurnChoice(), FreeTurnChoice(), PointAt(10.0, 20.0), ReadWatchdog()),
    *(SetWatchdog(2.0), SetWatchdog(0.0), Stop(), SelectBackup(Backup.REMOTE), SelectMode(AcuMode.REMOTE)),
)
REPLIES = (
    *(None, Done(), Refused(), SIMULATED, UNKNOWN, Commanded(10.0, 20.0), Commanded(10.1, 20.0), Commanded(10.0, 20.1)),
    *(TurnChoice(True), TurnChoice(False), WatchdogTime(2.0), WatchdogTime(2.02), WatchdogTime(0.0)),
)
WITHOUT_CONDITION = {  # stage, what was asked, and the reply: the next stage
    (StartStage.NEW, Identify(), SIMULATED): StartStage.IDENTIFIED,
    (StartStage.REGISTERS_KNOWN, ReadTurnChoice(), TurnChoice(True)): StartStage.SECTOR_FREE,
    (StartStage.REGISTERS_KNOWN, FreeTurnChoice(), Done()): StartStage.SECTOR_FREE,
    (StartStage.SECTOR_FREE, PointAt(10.0, 20.0), Done()): StartStage.PRESENT_WRITTEN,
    (StartStage.PRESENT_WRITTEN, ReadCommanded(), Commanded(10.0, 20.0)): StartStage.READY,
    (StartStage.PRESENT_WRITTEN, ReadCommanded(), Commanded(10.1, 20.0)): StartStage.SECTOR_FREE,
    (StartStage.PRESENT_WRITTEN, ReadCommanded(), Commanded(10.0, 20.1)): StartStage.SECTOR_FREE,
    **{
        (StartStage.IDENTIFIED, ReadCommanded(), one): StartStage.REGISTERS_KNOWN
        for one in REPLIES
        if isinstance(one, Commanded)
    },
}


def watchdog_after(
    asked: Any, reply: Any, before: Watchdog, stage: StartStage, *, is_refused: bool, tried_s: float
) -> Watchdog:
    """What is known of the watchdog."""
    if asked == Stop() and reply == Done() and before is Watchdog.UNKNOWN:
        return Watchdog.SET  # whether it was set was not read back: it is cleared
    if asked == SetWatchdog(0.0):
        return Watchdog.UNKNOWN if reply == Done() or is_refused else before
    if asked in (ReadWatchdog(), SetWatchdog(2.0)):
        if reply == WatchdogTime(2.0):
            return Watchdog.SET
        return Watchdog.REFUSED if is_refused or tried_s >= 2.0 else before
    is_forgotten = isinstance(asked, SelectBackup) and reply == Done() and stage is StartStage.READY
    return Watchdog.UNKNOWN if is_forgotten and before is Watchdog.SET else before


@pytest.mark.parametrize("is_remote", [False, True])
@pytest.mark.parametrize("tried_s", [None, 1.9, 2.0])
def test_each_reply_to_each_question_at_each_stage_moves_the_start_by_what_the_table_says(
    tried_s: float | None, is_remote: bool
) -> None:
    seen = AcuStatus(10.0, 20.0, AcuMode.STANDBY, is_remote_enabled=is_remote)
    for stage, asked, reply, watchdog in product(StartStage, ASKED, REPLIES, Watchdog):
        from_tai_s = None if tried_s is None else NOW_S - tried_s
        before = remembering(
            status=seen,
            stage=stage,
            watchdog=watchdog,
            watchdog_from_tai_s=from_tai_s,
            present_deg=(10.0, 20.0),
        )
        after = after_reply(before, Exchange(asked, reply), NOW_S, WATCHED, []).startup
        is_refused = reply == Refused() and is_remote
        expected = WITHOUT_CONDITION.get((stage, asked, reply), stage)
        if is_refused and (stage, asked) == (StartStage.REGISTERS_KNOWN, FreeTurnChoice()):
            expected = StartStage.SECTOR_FREE
        case = (stage, asked, reply, watchdog)
        assert after.stage is expected, case
        age_s = tried_s or 0.0
        known = watchdog_after(asked, reply, watchdog, stage, is_refused=is_refused, tried_s=age_s)
        assert after.watchdog is known, case
        is_tried = asked in (ReadWatchdog(), SetWatchdog(2.0))
        is_over = is_tried and (reply == WatchdogTime(2.0) or is_refused or age_s >= 2.0)
        begun = NOW_S if is_tried and from_tai_s is None else from_tai_s
        assert after.watchdog_from_tai_s == (None if is_over else begun), case
        is_identified = (stage, asked) == (StartStage.NEW, Identify()) and isinstance(reply, AcuIdentity)
        assert after.identity == (reply if is_identified else None), case
        assert after.is_identity_sure is (is_identified and reply == SIMULATED), case
        is_present = (stage, asked, reply) == (StartStage.SECTOR_FREE, PointAt(10.0, 20.0), Done())
        assert after.present_deg == (10.0, 20.0) or not is_present, case


@pytest.mark.parametrize("watchdog", Watchdog)
@pytest.mark.parametrize("stage", StartStage)
@pytest.mark.parametrize(("before", "now"), list(product(Backup, Backup)))
def test_a_backup_that_changed_by_itself_has_all_registers_read_again_before_anything_is_written(
    before: Backup, now: Backup, stage: StartStage, watchdog: Watchdog
) -> None:
    left = remembering(standing(), stage=stage, watchdog=watchdog)
    left = remembering(left, status=status(backup_selected=before))
    after = watch_for_power_cycle(left, status(backup_selected=now))
    if stage is StartStage.READY and before is Backup.REMOTE and now is not Backup.REMOTE:
        assert next_command(after, CONFIG) == ReadCommanded()
        assert after.startup.watchdog is (Watchdog.UNKNOWN if watchdog is Watchdog.SET else watchdog)
        assert after.startup.identity == left.startup.identity
    else:
        assert after == left

"""control.safety.turn_doubt: when a turn of the azimuth is doubted, and how the other one is learned, step by step."""

from dataclasses import replace
from math import inf
from typing import Any

import pytest
from memories import remembering
from test_tick import CONFIG, EL_DEG, NOW, status

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.safety.axis_watch import AxesWatch, AxisWatch, Bounds
from acu_daemon.control.safety.turn import BIT_SCORE, PATIENCE_S, PULL_S, Phase, TurnWatch, drive_s
from acu_daemon.control.safety.turn_doubt import (
    MOST_LEARNED,
    OTHERS_MODES,
    STANDS,
    doubt,
    is_watched,
    locate_azimuth,
    may_be_other_turn,
    on_other_turn,
    watch_turn,
)
from acu_daemon.control.state import ControlState, Held, Sent, StartStage
from acu_daemon.control.tick_input import Observation
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.model import Reading
from acu_daemon.pointing.axis import AxisState

MOMENT_S = STEP = 0.01
TICK_S, READINGS = 0.1, 6
UNWATCHED = replace(CONFIG, following=Bounds(error_s=0.0))
AXES = AxesWatch(az=AxisWatch(side=1))
STEP_WAY_S = PATIENCE_S + drive_s(10.0, CONFIG.azimuth)
SIDES = pytest.mark.parametrize("side", [1, -1])


def memory(
    az_deg: float, rate_deg_s: float = 0.0, seen: AcuStatus | None = None, *, count: int = READINGS, **changes: Any
) -> ControlState:
    """An antenna that has moved evenly for its newest readings, the last of them now."""
    seen = replace(seen or status(AcuMode.REMOTE), az_deg=az_deg % 360.0)
    ago_s = [TICK_S * k for k in reversed(range(count))]
    values: dict[str, Any] = {
        "track": TrackState.HOLD_TLE,
        "stage": StartStage.READY,
        "status": seen,
        "reading": Reading(NOW, az_deg % 360.0, seen.el_deg, is_locked=False),
        "az_deg": az_deg,
        "track_of_readings": tuple((NOW - ago, az_deg - rate_deg_s * ago, seen.el_deg) for ago in ago_s),
        "in_force": (NOW - 0.1, az_deg, seen.el_deg),
    }
    return remembering(**(values | changes))


def watch(state: ControlState, config: ControlConfig = CONFIG) -> tuple[ControlState, str, list[Event]]:
    """The newest status judged."""
    events: list[Event] = []
    observation = Observation(reading=state.intake.reading, status=state.intake.status)
    after, problem = watch_turn(state, observation, config, events)
    return after, problem, events


# A motion away from the command


def pulled(side: int, **changes: Any) -> ControlState:
    """Really at 269, believed at -91, and led on to -80: it goes down; mirrored too."""
    rate_deg_s = changes.pop("rate_deg_s", 5.0)
    in_force = changes.pop("in_force", (NOW, side * -80.0, EL_DEG))
    return memory(side * -91.0, side * -rate_deg_s, in_force=in_force, **changes)


@SIDES
def test_an_azimuth_that_moves_away_as_it_would_on_the_other_turn_may_be_on_it(side: int) -> None:
    assert may_be_other_turn(pulled(side), CONFIG)
    assert may_be_other_turn(pulled(side, turn=TurnWatch(learned_count=MOST_LEARNED - 1)), CONFIG)
    for turn in (TurnWatch(is_sure=True), TurnWatch(learned_count=MOST_LEARNED)):
        assert not may_be_other_turn(pulled(side, turn=turn), CONFIG)
    for phase in (Phase.STOPPING, Phase.MOVING):
        assert not may_be_other_turn(pulled(side, turn=TurnWatch(phase=phase)), CONFIG)
    assert not may_be_other_turn(pulled(side, in_force=None), CONFIG)
    assert not may_be_other_turn(pulled(side, rate_deg_s=-5.0), CONFIG)  # it follows


@SIDES
@pytest.mark.parametrize(("rate_deg_s", "is_seen"), [(1.0 + STEP, True), (1.0 - STEP, False)])
def test_its_rate_is_that_over_all_the_newest_readings(side: int, rate_deg_s: float, is_seen: bool) -> None:
    state = pulled(side, rate_deg_s=rate_deg_s)
    assert may_be_other_turn(state, CONFIG) is is_seen
    first, *_, last = state.intake.track_of_readings
    wild = [(last[0] - TICK_S * k, 77.0, EL_DEG) for k in range(4)]
    assert may_be_other_turn(remembering(state, track_of_readings=(first, *wild, last)), CONFIG) is is_seen
    at_once = [(NOW, first[1], EL_DEG), (NOW, last[1], EL_DEG)]
    assert not may_be_other_turn(remembering(state, track_of_readings=tuple(at_once)), CONFIG)
    assert not may_be_other_turn(remembering(state, track_of_readings=(last,)), CONFIG)


# The doubt


@pytest.mark.parametrize(
    ("az_deg", "other_deg", "half"), [(200.0, -160.0, "high"), (-160.0, 200.0, "low"), (10.0, None, "high")]
)
@pytest.mark.parametrize("is_high", [False, True])
def test_a_doubt_stops_the_antenna_forgets_its_way_and_says_both_turns(
    az_deg: float, other_deg: float | None, half: str, is_high: bool
) -> None:
    before = TurnWatch(True, 10, 3, 7, 1, Phase.BELIEVED, 5.0, 2, 250.0, 50.0, NOW, 1, 200.0, NOW, NOW - 1.0, 9.0, 8.0)
    state = memory(
        az_deg,
        seen=status(AcuMode.REMOTE, is_sector_high=is_high),
        turn=before,
        axes=AXES,
        problem="",
        held=Held(True),
        goal_az_deg=250.0,
    )
    events: list[Event] = []
    after = doubt(state, CONFIG, events, "why")
    fields = {
        "reason": "why",
        "az_deg": az_deg,
        "el_deg": EL_DEG,
        "goal_deg": 250.0,
        "turn": f"on the {half} half of the range as believed",
        "other_turn_deg": other_deg,
        "sector_bit": int(is_high),
        "action": "stopped; then moved by 5 deg on the other turn, away from the nearer stop",
    }
    assert events == [Event("turn.doubted", fields, is_warning=True)]
    problem = "why" if other_deg is None else f"turn doubted: azimuth {az_deg:.1f} deg as believed, or {other_deg:.1f}"
    assert after.turn == TurnWatch(
        sure_count=10,
        against_count=3,
        bit_score=7,
        wrong_half=1,
        phase=Phase.STOPPING,
        learned_count=2,
        mark_deg=200.0,
        pulled_since_tai_s=NOW - 1.0,
        pulled_from_deg=9.0,
        braking_deg=8.0,
        problem=problem,
    )
    assert after.arming.is_stop_due
    assert after.registers.in_force is None
    assert after.foreign_stop.held is None
    assert after.latch.axes == AxesWatch()


def test_a_doubt_without_a_status_tells_no_elevation_and_no_bit() -> None:
    events: list[Event] = []
    doubt(remembering(az_deg=200.0), CONFIG, events, "why")
    assert (events[0].fields["el_deg"], events[0].fields["sector_bit"]) == (None, None)


# Whose the antenna is


def in_doubt(phase: Phase = Phase.STOPPING, **changes: Any) -> TurnWatch:
    return replace(TurnWatch(phase=phase, learned_count=2, problem="late", move_to_deg=3.0, begun_tai_s=NOW), **changes)


OTHERS: dict[str, dict[str, Any]] = {
    "disarmed": {"by_people": False},
    "latched": {"latch": replace(ControlState().latch, problem="stands", axes=AXES)},
    "without a link": {"track": TrackState.LINK_LOST},
    "at the local panel": {"seen": status(AcuMode.REMOTE, is_remote_enabled=False)},
    **{str(mode): {"seen": status(mode)} for mode in OTHERS_MODES},
}


@pytest.mark.parametrize("how", OTHERS)
def test_an_antenna_that_is_not_ours_to_move_has_its_turn_believed_again(how: str) -> None:
    believed = TurnWatch(learned_count=2)
    for turn in (in_doubt(), in_doubt(Phase.MOVING), in_doubt(Phase.BELIEVED), in_doubt(problem="")):
        after, problem, events = watch(memory(200.0, **OTHERS[how], turn=turn))
        assert (after.turn, problem, events) == (believed, "", [])
    for turn in (TurnWatch(), TurnWatch(goal_deg=250.0, mark_tai_s=NOW - 99.0)):
        state = memory(200.0, **OTHERS[how], turn=turn, goal_az_deg=250.0)
        assert watch(state) == (state, "", [])


def test_no_turn_is_judged_without_a_new_reading_or_a_status() -> None:
    state = memory(200.0, turn=in_doubt(), by_people=False)
    for seen in (Observation(), Observation(status=status()), Observation(reading=Reading(NOW, 0.0, 0.0, False))):
        assert watch_turn(state, seen, CONFIG, []) == (state, "")


# On its way


def waiting(side: int, waited_s: float, *, gap_deg: float = 50.0, turned: int = 1, **changes: Any) -> ControlState:
    """An azimuth that has stood for so long on its way to a goal.  turned: 1 where it has another turn; 0: it has not.

    side: that of the goal.
    """
    az_deg = side * (-160.0 if turned else -10.0)
    goal_deg = az_deg + side * gap_deg
    turn = TurnWatch(
        goal_deg=goal_deg, way_deg=gap_deg, begun_tai_s=NOW, side=side, mark_deg=az_deg, mark_tai_s=NOW - waited_s
    )
    turn = replace(turn, **changes.pop("watch", {}))
    changes = {"in_force": (NOW - 0.1, goal_deg, EL_DEG), "goal_az_deg": goal_deg} | changes
    return memory(az_deg, turn=turn, **changes)


@SIDES
@pytest.mark.parametrize("late", [-1, 1])
def test_an_azimuth_that_stands_short_of_its_goal_longer_than_a_step_takes_is_doubted(side: int, late: int) -> None:
    state = waiting(side, STEP_WAY_S + late * MOMENT_S)
    after, problem, events = watch(state)
    assert problem == ""
    assert (after.turn.phase is Phase.STOPPING, after.arming.is_stop_due) == (late > 0, late > 0)
    assert [one.name for one in events] == (["azimuth.late", "turn.doubted"] if late > 0 else [])
    if late > 0:
        goal_deg = state.registers.goal_az_deg
        half = "low" if side > 0 else "high"
        at = f"at {side * -160.0:.1f} deg, on the {half} half of the range as believed"
        text = f"azimuth late: {at}, its goal at {goal_deg:.1f} deg"
        fields = {
            "az_deg": side * -160.0,
            "el_deg": EL_DEG,
            "goal_deg": goal_deg,
            "problem": text,
        }
        assert events[0] == Event("azimuth.late", fields, is_warning=True)
        assert events[1].fields["reason"] == "the azimuth moves no further towards its goal"


def test_an_azimuth_that_is_late_is_told_once() -> None:
    watch_before = {"problem": "late", "is_sure": True}
    after, _, events = watch(waiting(1, STEP_WAY_S + MOMENT_S, watch=watch_before))
    assert (after.turn.problem, events) == ("late", [])


@SIDES
@pytest.mark.parametrize(
    ("how", "is_doubted"),
    [
        ({}, True),
        ({"watch": {"learned_count": MOST_LEARNED - 1}}, True),
        ({"watch": {"is_sure": True}}, False),
        ({"watch": {"learned_count": MOST_LEARNED}}, False),
        ({"turned": 0}, False),
    ],
)
def test_a_turn_that_is_sure_or_the_only_one_or_learned_often_is_not_doubted_and_the_axis_is_stuck(
    side: int, how: dict[str, Any], is_doubted: bool
) -> None:
    after, problem, events = watch(waiting(side, STEP_WAY_S + MOMENT_S, **how))
    assert ("turn.doubted" in [one.name for one in events]) is is_doubted
    assert problem == ("" if is_doubted else STANDS)
    assert after.turn.phase is (Phase.STOPPING if is_doubted else Phase.BELIEVED)


def stuck(side: int, *, config: ControlConfig = CONFIG, waited_s: float = STEP_WAY_S + MOMENT_S, **how: Any) -> bool:
    return watch(waiting(side, waited_s, watch={"is_sure": True}, **how), config)[1] == STANDS


@SIDES
def test_an_azimuth_that_stands_is_stuck_only_where_a_command_leads_it_on_and_no_switch_holds_it(side: int) -> None:
    az_deg = side * -160.0
    assert stuck(side)
    assert not stuck(side, waited_s=STEP_WAY_S - MOMENT_S)
    assert not stuck(side, config=UNWATCHED)
    assert not stuck(side, in_force=None)
    assert stuck(side, in_force=(NOW, az_deg + side * (5.0 + STEP), EL_DEG))
    assert not stuck(side, in_force=(NOW, az_deg + side * 5.0, EL_DEG))
    assert not stuck(side, in_force=(NOW, az_deg - side * 50.0, EL_DEG))
    ahead, behind = ("is_at_cw_limit", "is_at_ccw_limit")[::side]
    assert not stuck(side, seen=status(AcuMode.REMOTE, **{ahead: True}))
    assert stuck(side, seen=status(AcuMode.REMOTE, **{behind: True}))
    for mode in set(AcuMode) - set(OTHERS_MODES):
        seen = status(mode, backup_selected=Backup.RATE)
        assert stuck(side, seen=seen, track=TrackState.PREPOSITION) is seen.follows_registers, mode


def test_an_axis_is_watched_where_a_following_error_has_its_time() -> None:
    assert is_watched(replace(CONFIG, following=Bounds(error_s=0.01)))
    assert not is_watched(UNWATCHED)


@pytest.mark.parametrize("track", TrackState)
@pytest.mark.parametrize("mode", [AcuMode.REMOTE, AcuMode.STANDBY])
@pytest.mark.parametrize("stage", [StartStage.PRESENT_WRITTEN, StartStage.READY])
def test_a_goal_is_where_followed_registers_lead_and_before_a_pass_it_is_kept(
    track: TrackState, mode: AcuMode, stage: StartStage
) -> None:
    state = waiting(1, 1.0, gap_deg=30.0, track=track, seen=status(mode), stage=stage, goal_az_deg=-100.0)
    after, _, _ = watch(state)
    if track is TrackState.LINK_LOST:
        assert after == state
    elif stage is StartStage.READY and track in ACTIVE and mode is AcuMode.REMOTE:
        assert after.turn.goal_deg == -100.0
    elif stage is StartStage.READY and track is TrackState.PREPOSITION:
        assert after.turn.goal_deg == -130.0
    else:
        assert after.turn.goal_deg is None


def test_before_a_pass_the_goal_is_kept_where_no_register_has_one() -> None:
    kept = waiting(1, 1.0, track=TrackState.PREPOSITION, goal_az_deg=None)
    assert watch(kept)[0].turn.goal_deg == kept.turn.goal_deg
    assert watch(waiting(1, 1.0, track=TrackState.PROGRAM, goal_az_deg=None))[0].turn.goal_deg is None


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("el_deg", "noise_deg"), [(0.0, 0.1), (60.0, 0.2)])
def test_a_pull_counts_when_it_is_farther_than_braking_and_noise_on_the_sky(
    side: int, direction: int, el_deg: float, noise_deg: float
) -> None:
    """Away from -91, or 91, to the stop that is between."""
    seen = replace(status(AcuMode.REMOTE), el_deg=el_deg)
    from_deg = direction * (-91.0 + 3.0 + 1.0 + noise_deg + side * STEP)
    turn = TurnWatch(pulled_since_tai_s=NOW - PULL_S - MOMENT_S, pulled_from_deg=from_deg, braking_deg=3.0)
    goal_deg = direction * -80.0
    after, problem, events = watch(pulled(direction, turn=turn, goal_az_deg=goal_deg, seen=seen))
    assert problem == ""
    assert (after.turn.phase is Phase.STOPPING) is (side > 0)
    reasons = [one.fields["reason"] for one in events]
    assert reasons == (["the azimuth moves away from its command, as it would on the other turn"] if side > 0 else [])


def test_no_pull_counts_without_a_goal_or_in_a_mode_that_follows_no_registers() -> None:
    turn = TurnWatch(pulled_since_tai_s=NOW - 9.0, pulled_from_deg=0.0, goal_deg=-80.0, side=1, mark_deg=-91.0)
    turn = replace(turn, begun_tai_s=NOW, way_deg=11.0, mark_tai_s=NOW)
    for how in (
        {"goal_az_deg": None},
        {"goal_az_deg": -80.0, "seen": status(AcuMode.STANDBY), "track": TrackState.PREPOSITION},
        {"goal_az_deg": -80.0, "rate_deg_s": 0.5},
    ):
        after, problem, events = watch(pulled(1, turn=turn, **how))
        assert (after.turn.phase, after.turn.pulled_since_tai_s, problem, events) == (Phase.BELIEVED, inf, "", [])
    after, _, _ = watch(pulled(1, goal_az_deg=-80.0, rate_deg_s=6.0))
    assert after.turn.pulled_since_tai_s == NOW
    assert after.turn.braking_deg == pytest.approx(6.0**2 * 2.0 / 20.0)
    at_rest = memory(10.0, goal_az_deg=10.5)
    assert watch(at_rest)[0] is at_rest


# Stopping


def stopping(az_deg: float, rate_deg_s: float = 0.0, begun_s: float = 1.0, **changes: Any) -> ControlState:
    """An antenna that was seen to stand first so long ago."""
    seen = replace(status(AcuMode.STANDBY), el_deg=changes.pop("el_deg", EL_DEG))
    values: dict[str, Any] = {
        "seen": changes.pop("seen", seen),
        "turn": in_doubt(move_to_deg=None, begun_tai_s=NOW - begun_s),
        "axis_az": AxisState(az_deg, 1.0),
        "commands": (Sent(az_deg, EL_DEG, True),),
        "in_force": None,
    }
    return memory(az_deg, rate_deg_s, **(values | changes))


@pytest.mark.parametrize(
    ("az_deg", "other_deg", "to_deg"),
    [(200.0, -160.0, -155.0), (-160.0, 200.0, 195.0), (100.0, -260.0, -255.0), (-100.0, 260.0, 255.0)],
)
def test_once_it_stands_the_other_turn_is_tried_with_a_step_away_from_its_nearer_stop(
    az_deg: float, other_deg: float, to_deg: float
) -> None:
    after, problem, events = watch(stopping(az_deg))
    fields = {"az_deg": other_deg, "believed_deg": az_deg, "move_to_deg": to_deg}
    assert (problem, events) == ("", [Event("turn.tried", fields)])
    assert after.turn == in_doubt(Phase.MOVING, move_to_deg=to_deg, begun_tai_s=inf)
    assert after.intake.az_deg == other_deg
    assert {az for _, az, _ in after.intake.track_of_readings} == {other_deg}
    assert after.startup.stage is StartStage.REGISTERS_KNOWN  # the present angles are written first
    assert (after.registers.axis_az, after.registers.commands) == (None, ())


def test_a_step_goes_away_from_the_stop_that_is_nearer_in_a_range_that_is_not_even() -> None:
    uneven = replace(CONFIG, envelope=replace(CONFIG.envelope, azimuth=replace(CONFIG.azimuth, min_deg=-30.0)))
    uneven = replace(uneven, envelope=replace(uneven.envelope, azimuth=replace(uneven.azimuth, max_deg=500.0)))
    for az_deg, to_deg in [(10.0, 365.0), (370.0, 15.0)]:
        assert watch(stopping(az_deg), uneven)[0].turn.move_to_deg == to_deg


@pytest.mark.parametrize("mode", AcuMode)
def test_a_stop_is_waited_for_until_it_is_acknowledged_and_the_mode_is_one_that_stands(mode: AcuMode) -> None:
    seen = status(mode, backup_selected=Backup.RATE)
    state = stopping(200.0, seen=seen)
    stands = {AcuMode.STANDBY, AcuMode.ACQUIRE, AcuMode.POSITION_MEMORY}
    if mode not in OTHERS_MODES:
        assert (watch(state)[0].turn.phase is Phase.MOVING) is (mode in stands)
        owing = remembering(state, is_stop_due=True)
        assert watch(owing) == (owing, "", [])


@pytest.mark.parametrize("count", [READINGS - 1, READINGS])
def test_it_stands_by_all_the_newest_readings(count: int) -> None:
    assert (watch(stopping(200.0, count=count))[0].turn.phase is Phase.MOVING) is (count == READINGS)


def test_the_time_of_braking_counts_from_the_first_reading_that_was_stopped() -> None:
    for begun_s in (inf, -inf, -3.0):
        state = stopping(200.0, 5.0, begun_s=-abs(begun_s))
        assert watch(state)[0].turn.begun_tai_s == NOW
    assert watch(stopping(200.0, 5.0, begun_s=2.0))[0].turn.begun_tai_s == NOW - 2.0


@SIDES
@pytest.mark.parametrize(
    ("moved_deg", "el_deg", "begun_s", "stands"),
    [
        (0.1 - 1e-3, 0.0, 1.0, True),
        (0.1 + 1e-3, 0.0, 1.0, False),
        (0.1 + 1e-3, 0.0, 4.0 - MOMENT_S, False),
        (0.1 + 1e-3, 0.0, 4.0 + MOMENT_S, True),
        (0.2 - 1e-3, 0.0, 5.0, True),
        (0.2 + 1e-3, 0.0, 5.0, False),
        (0.4 - 1e-3, 60.0, 5.0, True),
        (0.4 + 1e-3, 60.0, 5.0, False),
    ],
)
def test_it_stands_when_it_moves_less_than_a_tenth_of_a_degree_or_has_had_its_time_to_brake(
    side: int, moved_deg: float, el_deg: float, begun_s: float, stands: bool
) -> None:
    rate_deg_s = side * moved_deg / (TICK_S * (READINGS - 1))
    after, _, _ = watch(stopping(200.0, rate_deg_s, begun_s, el_deg=el_deg))
    assert (after.turn.phase is Phase.MOVING) is stands


def test_what_came_to_a_bearing_of_one_turn_while_it_braked_is_believed_and_starts_anew() -> None:
    after, problem, events = watch(stopping(10.0))
    assert (problem, events) == ("", [])
    assert after.turn == TurnWatch(learned_count=2)
    assert (after.startup.stage, after.registers.axis_az) == (StartStage.REGISTERS_KNOWN, None)


# Moving


def moving(off_deg: float, *, begun_s: float = 1.0, **changes: Any) -> ControlState:
    """An antenna so far from where it shall step to on the other turn."""
    turn = in_doubt(Phase.MOVING, move_to_deg=-155.0, begun_tai_s=NOW - begun_s)
    return memory(-155.0 + off_deg, **({"turn": turn} | changes))


@SIDES
def test_a_turn_is_learned_where_the_antenna_follows_on_it(side: int) -> None:
    after, problem, events = watch(moving(side * (1.0 - STEP)))
    fields = {"az_deg": -155.0 + side * (1.0 - STEP), "by": "the antenna follows on it"}
    assert (problem, events) == ("", [Event("turn.learned", fields)])
    assert after.turn == TurnWatch(learned_count=3)
    for off_deg in (1.0, 1.0 + STEP):
        not_yet = moving(side * off_deg)
        assert watch(not_yet) == (not_yet, "", [])
    for how in (
        {"stage": StartStage.PRESENT_WRITTEN},
        {"seen": status(AcuMode.STANDBY)},
        {"turn": in_doubt(Phase.MOVING, move_to_deg=None)},
    ):
        state = moving(0.0, **how)
        assert watch(state) == (state, "", [])


@pytest.mark.parametrize(
    ("seen", "is_learned"),
    [
        (status(AcuMode.AUTOTRACK), True),
        (status(AcuMode.AUTOTRACK, is_acquired=False), False),
        (status(AcuMode.REMOTE, is_acquired=True), False),
    ],
)
def test_a_turn_is_learned_where_autotrack_holds_the_satellite(seen: AcuStatus, is_learned: bool) -> None:
    after, problem, events = watch(moving(30.0, seen=seen, begun_s=99.0), UNWATCHED)
    assert problem == ""
    assert [one.fields["by"] for one in events] == (["autotrack holds the satellite"] if is_learned else [])
    assert (after.turn.phase is Phase.BELIEVED, after.turn.learned_count) == (is_learned, 2 + is_learned)


def test_the_time_to_follow_counts_from_when_the_registers_lead_it() -> None:
    late = {"turn": in_doubt(Phase.MOVING, move_to_deg=-155.0, begun_tai_s=inf)}
    assert watch(moving(3.0, **late))[0].turn.begun_tai_s == NOW
    for how in ({"stage": StartStage.PRESENT_WRITTEN}, {"seen": status(AcuMode.STANDBY)}):
        assert watch(moving(3.0, **late, **how))[0].turn.begun_tai_s == inf


@pytest.mark.parametrize("late", [-1, 1])
@pytest.mark.parametrize("is_standing", [False, True])
def test_an_antenna_that_follows_on_neither_turn_is_stuck_on_the_one_that_was_believed(
    late: int, is_standing: bool
) -> None:
    seen = status(AcuMode.STANDBY if is_standing else AcuMode.REMOTE)
    state = moving(-5.0, begun_s=STEP_WAY_S + late * MOMENT_S, seen=seen)
    after, problem, events = watch(state)
    assert watch(state, UNWATCHED) == (state, "", [])
    assert (problem, events) == (STANDS if late > 0 else "", [])
    if late > 0:
        assert after.intake.az_deg == 200.0
        assert after.registers.in_force == (NOW - 0.1, 200.0, EL_DEG)
        assert after.turn == TurnWatch(learned_count=2)
    else:
        assert after == state


def test_an_antenna_that_is_stuck_on_the_only_turn_stays_there() -> None:
    state = memory(10.0, turn=in_doubt(Phase.MOVING, move_to_deg=5.0, begun_tai_s=NOW - 99.0))
    after, problem, _ = watch(state)
    assert (after.intake.az_deg, problem) == (10.0, STANDS)


# Where the azimuth is


def located(
    before_deg: float, now_deg: float, is_high: bool, *, dt_s: float = 0.1, config: ControlConfig = CONFIG, **how: Any
) -> tuple[ControlState, float, list[Event]]:
    events: list[Event] = []
    seen = replace(status(AcuMode.REMOTE, is_sector_high=is_high), az_deg=now_deg % 360.0)
    reading = Reading(NOW + dt_s, now_deg % 360.0, EL_DEG, is_locked=False)
    state, az_deg = locate_azimuth(memory(before_deg, **how), seen, reading, config, events)
    return state, az_deg, events


@pytest.mark.parametrize(
    ("how", "is_counted"),
    [
        ({"stage": StartStage.READY}, True),
        ({}, False),
        ({"turn": TurnWatch(is_sure=True)}, True),
        ({"turn": TurnWatch(phase=Phase.STOPPING)}, True),
        ({"turn": TurnWatch(phase=Phase.MOVING)}, True),
        ({"turn": TurnWatch(wrong_half=0, bit_score=9)}, True),
    ],
)
@SIDES
def test_an_azimuth_is_counted_on_once_the_start_is_done_or_its_turn_sure_or_doubted(
    side: int, how: dict[str, Any], is_counted: bool
) -> None:
    how = {"stage": StartStage.PRESENT_WRITTEN} | how
    state, az_deg, events = located(side * 200.0, side * 199.0, side < 0, **how)
    assert az_deg == pytest.approx(side * (199.0 if is_counted else -161.0))
    assert events == []
    moved_deg = 0.0 if is_counted else -side * 360.0
    assert state.intake.az_deg == pytest.approx(side * 200.0 + moved_deg)
    assert state.registers.in_force == (NOW - 0.1, side * 200.0 + moved_deg, EL_DEG)
    assert (state.latch.axes, state.turn.learned_count) == (AxesWatch(), 0)


@pytest.mark.parametrize(("dt_s", "is_counted"), [(4.25 - MOMENT_S, True), (4.25 + MOMENT_S, False)])
def test_an_azimuth_is_counted_on_while_its_drive_cannot_have_made_half_a_turn(dt_s: float, is_counted: bool) -> None:
    assert located(200.0, 199.0, False, dt_s=dt_s)[1] == pytest.approx(199.0 if is_counted else -161.0)
    state, az_deg, events = located(200.0, 199.0, False, reading=None, axes=AXES)
    assert (az_deg, state.intake.az_deg, state.latch.axes, events) == (pytest.approx(-161.0), 200.0, AXES, [])


@pytest.mark.parametrize(("az_deg", "is_high"), [(200.0, False), (-160.0, True)])
def test_a_bit_that_is_found_wrong_or_right_again_is_told_once(az_deg: float, is_high: bool) -> None:
    nearly = TurnWatch(bit_score=BIT_SCORE - 2)
    state, _, events = located(az_deg, az_deg, is_high, turn=nearly)
    fields = {"az_deg": az_deg, "sector_bit": int(is_high), "action": "the turn is counted without it"}
    assert events == [Event("sector.wrong", fields, is_warning=True)]
    assert state.turn.wrong_half == int(az_deg > 0.0)
    assert located(az_deg, az_deg, is_high, turn=replace(state.turn, bit_score=BIT_SCORE - 2))[2] == []
    right, _, events = located(az_deg, az_deg, not is_high, turn=replace(state.turn, bit_score=1))
    assert (events, right.turn.wrong_half) == ([Event("sector.right")], None)
    without = replace(CONFIG, acu=Capabilities(has_sector_bit=False))
    assert located(az_deg, az_deg, is_high, turn=nearly, config=without)[2] == []


@SIDES
@pytest.mark.parametrize("is_high", [False, True])
def test_a_turn_that_readings_correct_moves_all_that_is_remembered_and_is_learned(side: int, is_high: bool) -> None:
    """Believed at -269 it goes on to -272, which is no place: it is at 88."""
    turn = TurnWatch(against_count=4, goal_deg=5.0, mark_tai_s=NOW, problem="late", learned_count=2)
    state, az_deg, events = located(side * -269.0, side * -272.0, is_high, turn=turn, axes=AXES)
    fields = {"az_deg": side * 88.0, "believed_deg": side * -272.0, "sector_bit": int(is_high)}
    assert az_deg == pytest.approx(side * 88.0)
    assert events == [Event("turn.corrected", fields, is_warning=True)]
    assert state.intake.az_deg == side * 91.0
    assert state.registers.in_force == (NOW - 0.1, side * 91.0, EL_DEG)
    assert (state.turn.learned_count, state.turn.problem, state.turn.goal_deg) == (3, "", None)
    assert state.latch.axes == AxesWatch()
    counted = located(side * -269.0, side * -272.0, is_high, turn=replace(turn, against_count=3))
    assert (counted[1], counted[2]) == (pytest.approx(side * -272.0), [])


def test_a_place_that_stays_leaves_the_memory_as_it_is() -> None:
    before = memory(10.0, turn=TurnWatch(is_sure=True, sure_count=10))
    reading = Reading(NOW + 0.1, 10.0, EL_DEG, is_locked=False)
    seen = replace(status(AcuMode.REMOTE), az_deg=10.0)
    assert locate_azimuth(before, seen, reading, CONFIG, [])[0] is before


@pytest.mark.parametrize("shift_deg", [360.0, -360.0])
def test_another_turn_moves_places_and_registers_and_begins_the_watch_of_the_axes_anew(shift_deg: float) -> None:
    state = memory(10.0, 5.0, axes=AXES, axis_az=AxisState(11.0, 2.0), commands=(Sent(1.0, 2.0, True),))
    after = on_other_turn(state, shift_deg)
    assert after.intake.az_deg == 10.0 + shift_deg
    places = state.intake.track_of_readings
    assert after.intake.track_of_readings == tuple((tai_s, az + shift_deg, el) for tai_s, az, el in places)
    registers = after.registers
    assert (registers.axis_az, registers.commands) == (AxisState(11.0 + shift_deg, 2.0), ())
    assert registers.in_force == (NOW - 0.1, 10.0 + shift_deg, EL_DEG)
    assert after.latch.axes == AxesWatch()
    bare = on_other_turn(memory(10.0, in_force=None), shift_deg)
    assert (bare.registers.axis_az, bare.registers.in_force) == (None, None)

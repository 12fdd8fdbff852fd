"""The decision of a tick is the same in a mirror: left and right, up and down, and whichever way north is."""

from collections import Counter
from functools import cache
from typing import Any

import pytest
from mirrors import MIRRORS, Mirror
from troubled_decision import TroubledDecision

from acu_daemon.acu.commands import Command, PointAndPoll, PointAt
from acu_daemon.control.orders import Orders
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import TickInput
from acu_daemon.drivers.sa3842.angles import LSB_DEG

SEEDS = range(24)
TICKS = 300
TOLERANCE_DEG = 1.5 * LSB_DEG  # a rounding that falls on the other side
SEEN = {  # of events, that the runs are worth something
    *("axis.latched", "turn.doubted", "turn.tried", "search.begins", "gate.limited", "gate.refused", "sector.wrong"),
    *("acu.refused_write", "disarmed", "offset.refused", "encoder.frozen", "state.changed", "pass.late"),
}


@cache
def run_of(seed: int) -> tuple[TroubledDecision, list[tuple[ControlState, Orders]]]:
    decision = TroubledDecision(seed)
    return decision, list(decision.run(TICKS))


def facts(orders: Orders) -> list[tuple[str, Any, Any]]:
    """The events, without the angles in them."""
    return [(event.name, event.fields.get("cause"), event.fields.get("problem", "") == "") for event in orders.events]


def memory(state: ControlState) -> tuple[Any, ...]:
    """What a mirror does not change."""
    counts = (state.refusals.refusal_count, state.refusals.clamped_count, state.refusals.limited_count)
    turn = (state.turn.phase, state.turn.is_sure, state.turn.learned_count, state.turn.bit_score)
    where = (
        state.tracking.track,
        state.startup.stage,
        state.latch.problem,
        state.arming.is_stop_due,
        state.signal.has_locked,
        state.registers.was_followed,
    )
    return (*where, *turn, *counts, state.encoders.problem, state.search.scan.side)


def lags(state: ControlState) -> list[float]:
    """What was learned of both."""
    return [
        number
        for lag in (state.lag.az, state.lag.el)
        for number in (lag.count, lag.sum_ss_deg2, lag.sum_sx_deg2, lag.sum_xx_deg2)
    ]


def same(command: Command | None, of_mirror: Command | None, mirror: Mirror) -> bool:
    if not isinstance(command, PointAndPoll | PointAt):
        return command == of_mirror
    if type(command) is not type(of_mirror):
        return False
    az_deg, el_deg = mirror.az_deg(command.az_deg), mirror.el * command.el_deg
    return abs(az_deg - of_mirror.az_deg) < TOLERANCE_DEG and abs(el_deg - of_mirror.el_deg) < TOLERANCE_DEG


@pytest.mark.long
@pytest.mark.parametrize("name", MIRRORS)
@pytest.mark.parametrize("seed", SEEDS)
def test_the_mirrored_world_gets_the_mirrored_commands_and_the_same_events(name: str, seed: int) -> None:
    mirror = MIRRORS[name]
    decision, ordered = run_of(seed)
    config, state = mirror.config(decision.config), ControlState()
    for k, (one, (plain, orders)) in enumerate(zip(decision.given, ordered, strict=True)):
        state, of_mirror = tick(state, TickInput(mirror.seen(one.seen), mirror.sky(one.sky), one.now_tai_s), config)
        assert same(orders.first, of_mirror.first, mirror), (k, orders, of_mirror)
        assert same(orders.extra, of_mirror.extra, mirror), (k, orders, of_mirror)
        assert facts(orders) == facts(of_mirror), (k, orders, of_mirror)
        assert memory(plain) == memory(state), k
        assert lags(state) == pytest.approx(lags(plain), rel=1e-3, abs=1e-4), k


def test_the_runs_go_through_all_that_a_mirror_could_show() -> None:
    runs = [run_of(seed) for seed in SEEDS]
    events = Counter(event.name for _, ordered in runs for _, orders in ordered for event in orders.events)
    assert not SEEN - set(events), events
    states = Counter(state.tracking.track for _, ordered in runs for state, _ in ordered)
    assert len(states) == 12, states
    assert sum(ordered[-1][0].lag.az.count for _, ordered in runs) > 50

"""What the decision did in the runs of `troubled_decision`, in lines of text: to be compared with what it does now.

A line for each tick in which something changed, with all that changed; each tenth tick the registers as well.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from troubled_decision import START_TAI_S, TroubledDecision

from acu_daemon.acu.commands import PointAndPoll, PointAt, command_text
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Orders
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import StowBy
from acu_daemon.drivers.sa3842.sa3842_driver import wire_command

RECORDED = Path(__file__).parent / "recorded_decisions.txt"
EVERY = 10  # ticks
NOTE = "# What scripts/record.py has recorded.  A change that is meant: run it again, and read the difference.\n"


def facts(state: ControlState, orders: Orders, config: ControlConfig) -> dict[str, Any]:
    """What people and the ACU notice of a tick, and what the next ones depend on."""
    armed = state.is_armed(config)
    return {
        "state": state.tracking.track,
        "start": state.startup.stage.name,
        "watchdog": state.startup.watchdog.name,
        "armed": "yes" if armed else state.arming.disarmed_by or "no",
        "stop_due": state.arming.is_stop_due,
        "held": state.foreign_stop.held is not None,
        "doubted": state.foreign_stop.is_doubted,
        "faults_read": state.interlock.faults_read is not None,
        "stow_kept": state.stow.stow_by is StowBy.PANEL,
        "latch": state.latch.problem,
        "turn": state.turn.phase.name,
        "turn_sure": state.turn.is_sure,
        "turns_learned": state.turn.learned_count,
        "wrong_half": state.turn.wrong_half,
        "azimuth": state.turn.problem.partition(":")[0],
        "encoders": state.encoders.problem,
        "followed": state.registers.was_followed,
        "refusal": state.refusals.refusal,
        "limited": state.refusals.limited.partition(" ")[0],
        "acquired": state.signal.has_acquired,
        "locked": state.signal.has_locked,
        "offset_refused": state.signal.is_offset_refused,
        "row": (state.search.scan.row, state.search.scan.side, state.search.scan.is_moving),
        "first": type(wire_command(orders.first)).__name__,
        "extra": "" if orders.extra is None else command_text(wire_command(orders.extra)).partition(" az")[0],
    }


def figures(state: ControlState) -> dict[str, float]:
    """Counts, and what was learned."""
    return {
        "refusal_count": state.refusals.refusal_count,
        "clamped_count": state.refusals.clamped_count,
        "limited_count": state.refusals.limited_count,
        "lag_az": state.lag.az.count,
        "lag_el": state.lag.el.count,
        "hold_from": round(max(state.tracking.hold_from_tai_s - START_TAI_S, -1.0), 1),
    }


def lines(decision: TroubledDecision, ordered: list[tuple[ControlState, Orders]]) -> Iterator[str]:
    """One run."""
    before: dict[str, Any] = {}
    for k, (state, orders) in enumerate(ordered):
        now = facts(state, orders, decision.config)
        if k % EVERY == 0:
            now |= figures(state)
        changed = [f"{name}={value}" for name, value in now.items() if before.get(name) != value]
        told = [event.name for event in orders.events]
        if changed or told:
            yield f"{k} {'; '.join([*changed, *told])}"
        before |= now
        for command in (orders.first, orders.extra):
            if isinstance(command, PointAt) or (isinstance(command, PointAndPoll) and k % EVERY == 0):
                yield f"{k} registers {command.az_deg:.3f} {command.el_deg:.3f}"

"""SIMULATION: what breaks in the ACU, at the panel and on the pedestal when a fault begins, and what its end mends."""

from collections.abc import Callable
from math import inf

from acu_daemon.drivers.sa3842.messages import ResetFault
from acu_daemon.edge.clock import Clock
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import VERBS, Fault, VerbName
from acu_daemon.sim.pedestal import Axis, AxisTrouble

EMERGENCY_STOP_BIT = 0  # of the interlock nibble: docs/protocol.md, Fault detail

Act = Callable[[FakeAcu, Fault, bool, float], None]


def break_acu(acu: FakeAcu, board: FaultBoard, clock: Clock) -> None:
    """Let the faults of a board act on an ACU."""

    def act(fault: Fault, is_on: bool) -> None:
        if VERBS[fault.verb].place == "pedestal":
            now_tai_s = clock.tai_s()
            acu.advance(now_tai_s)
            _ACTS[fault.verb](acu, fault, is_on, now_tai_s)

    board.listen(act)


def _power(acu: FakeAcu, _fault: Fault, is_on: bool, now_tai_s: float) -> None:
    if is_on:
        acu.power_off(now_tai_s)
    else:
        acu.power_on(now_tai_s)


def _local(acu: FakeAcu, _fault: Fault, is_on: bool, now_tai_s: float) -> None:
    acu.set_local(is_on, now_tai_s)


def _emergency_stop(acu: FakeAcu, _fault: Fault, is_on: bool, now_tai_s: float) -> None:
    if is_on:
        acu.begin_fault("interlock", EMERGENCY_STOP_BIT, now_tai_s)
    else:
        acu.end_fault("interlock", EMERGENCY_STOP_BIT, now_tai_s)
        acu.answer(ResetFault())


def _freeze(acu: FakeAcu, fault: Fault, is_on: bool, _now_tai_s: float) -> None:
    antenna = acu.antenna
    if "azimuth" in fault.axes:
        antenna.trouble.frozen_az_deg = antenna.az.angle_deg if is_on else None
    if "elevation" in fault.axes:
        antenna.trouble.frozen_el_deg = antenna.el.angle_deg if is_on else None


def _slip(acu: FakeAcu, fault: Fault, is_on: bool, _now_tai_s: float) -> None:
    jump_deg = fault.amount if is_on else -fault.amount
    acu.antenna.slip(*(jump_deg if axis in fault.axes else 0.0 for axis in ("azimuth", "elevation")))


def _turn(acu: FakeAcu, _fault: Fault, is_on: bool, _now_tai_s: float) -> None:
    acu.antenna.trouble.is_turn_wrong = is_on


def _backlash(acu: FakeAcu, fault: Fault, is_on: bool, _now_tai_s: float) -> None:
    play_deg = fault.amount if is_on else 0.0
    acu.antenna.trouble.play_deg = (
        play_deg if "azimuth" in fault.axes else 0.0,
        play_deg if "elevation" in fault.axes else 0.0,
    )


def _false_lock(acu: FakeAcu, _fault: Fault, is_on: bool, _now_tai_s: float) -> None:
    acu.antenna.trouble.carrier_deg = acu.antenna.boresight_deg if is_on else None


def _silence(acu: FakeAcu, _fault: Fault, is_on: bool, _now_tai_s: float) -> None:
    acu.antenna.trouble.is_silent = is_on


def _axis(change: Callable[[Axis, AxisTrouble, Fault, bool], None]) -> Act:
    """A trouble of the axes that a fault names; those of other verbs go on when it ends."""

    def act(acu: FakeAcu, fault: Fault, is_on: bool, _now_tai_s: float) -> None:
        for name in fault.axes:
            axis = acu.antenna.az if name == "azimuth" else acu.antenna.el
            trouble = axis.trouble or AxisTrouble()
            if is_on:
                trouble.random.seed(f"{fault.seed} {name}")
            change(axis, trouble, fault, is_on)
            axis.trouble = None if trouble == AxisTrouble() else trouble

    return act


def _stop_here(axis: Axis, trouble: AxisTrouble, fault: Fault, is_on: bool) -> None:
    if fault.amount > 0.0:
        trouble.upper_stop_deg = axis.angle_deg if is_on else inf
    else:
        trouble.lower_stop_deg = axis.angle_deg if is_on else -inf


def _stick(_axis: Axis, trouble: AxisTrouble, _fault: Fault, is_on: bool) -> None:
    trouble.is_stuck = is_on


def _run_away(_axis: Axis, trouble: AxisTrouble, fault: Fault, is_on: bool) -> None:
    trouble.runaway_deg_s = fault.amount if is_on else None


def _slow_down(_axis: Axis, trouble: AxisTrouble, fault: Fault, is_on: bool) -> None:
    trouble.rate_share = fault.amount if is_on else 1.0


def _reverse(_axis: Axis, trouble: AxisTrouble, _fault: Fault, is_on: bool) -> None:
    trouble.is_reversed = is_on


def _blow(_axis: Axis, trouble: AxisTrouble, fault: Fault, is_on: bool) -> None:
    trouble.gust_deg_s = fault.amount if is_on else 0.0


_ACTS: dict[VerbName, Act] = {
    "power-cycle": _power,
    "local-panel": _local,
    "emergency-stop": _emergency_stop,
    "frozen-encoder": _freeze,
    "encoder-jump": _slip,
    "encoder-turn": _turn,
    "backlash": _backlash,
    "silence": _silence,
    "false-lock": _false_lock,
    "limit-switch": _axis(_stop_here),
    "stuck": _axis(_stick),
    "runaway": _axis(_run_away),
    "slow-drive": _axis(_slow_down),
    "reversed": _axis(_reverse),
    "wind": _axis(_blow),
}

"""P1, P4: what another hand did while the daemon had no link, hung or was dead, told from the ACU's own doing.

The real daemon on its state directory, against the fake ACU in virtual time (promise_rig.py).
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from promise_rig import HANDS, Rig, demo_scene

from acu_daemon.drivers.sa3842.messages import Faults, Status
from acu_daemon.edge.latch import DISARMED
from acu_daemon.edge.run_state import RUN_STATE
from acu_daemon.sim import acu_status

LOCK_S, OUTAGE_S = 8.0, 3.0
BY_HAND = "another hand that stopped the antenna"
CUT = f"cut duration_s={OUTAGE_S}"
W_TRIPS_S = 7.0  # of an outage: longer than the register watchdog's 5 s


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    """Fitted, and the signal lost."""
    with Rig(tmp_path, demo_scene()) as made:
        made.wait(LOCK_S)
        made.fault("silence")
        made.wait(2.0)
        assert made.state.tracking.track == "HOLD/FITTED"
        yield made
        assert not made.judge.broken, made.judge.broken


def meanwhile(rig: Rig, what: str) -> None:
    """Somebody does it a second from now."""

    def act() -> None:
        rig.acu.advance(rig.clock.tai_s())
        rig.acu.answer(HANDS[what])

    rig.loop.call_later(1.0, act)


def cut(rig: Rig) -> None:
    rig.fault(CUT)
    rig.wait(OUTAGE_S)


def refused(rig: Rig) -> None:
    rig.fault(f"second-client duration_s={OUTAGE_S}")
    rig.wait(OUTAGE_S)


def dead(rig: Rig) -> None:
    rig.crash(OUTAGE_S)


OUTAGES = [cut, refused, dead]


@pytest.mark.long
@pytest.mark.parametrize("outage", OUTAGES)
@pytest.mark.parametrize("what", ["stop", "standby"])
def test_p1_a_stop_in_an_outage_is_respected_until_a_person_arms(
    rig: Rig, outage: Callable[[Rig], None], what: str
) -> None:
    meanwhile(rig, what)
    outage(rig)
    rig.wait(3.0)
    assert (rig.state.is_armed(rig.config), rig.state.arming.disarmed_by) == (False, BY_HAND)
    orders = rig.judge.order_count
    rig.wait(3.0)
    assert rig.judge.order_count == orders
    rig.ask("arm")
    rig.wait(3.0)
    assert rig.state.tracking.track == "HOLD/FITTED"


def test_p1_a_stop_while_the_daemon_hangs_is_respected(rig: Rig) -> None:
    rig.hand("stop")
    rig.skip(2.0)
    rig.wait(3.0)
    assert rig.state.arming.disarmed_by == BY_HAND


@pytest.mark.long
@pytest.mark.parametrize("outage", OUTAGES)
def test_p1_a_takeover_by_the_panel_that_is_over_when_the_outage_is_counts_as_a_stop(
    rig: Rig, outage: Callable[[Rig], None]
) -> None:
    rig.fault("local-panel start_s=1 duration_s=1")
    outage(rig)
    rig.wait(3.0)
    assert rig.state.arming.disarmed_by == BY_HAND


@pytest.mark.parametrize("outage", OUTAGES)
def test_p1_an_emergency_stop_that_is_reset_within_an_outage_disarms(rig: Rig, outage: Callable[[Rig], None]) -> None:
    rig.fault("emergency-stop start_s=1 duration_s=1")
    outage(rig)
    rig.wait(3.0)
    assert rig.state.arming.disarmed_by == BY_HAND


@pytest.mark.long
@pytest.mark.parametrize("outage", OUTAGES)
def test_p1_a_stow_in_an_outage_is_kept_through_another_crash(rig: Rig, outage: Callable[[Rig], None]) -> None:
    meanwhile(rig, "stow")
    outage(rig)
    rig.wait(30.0)
    assert rig.state.tracking.track == "STOW"
    rig.crash(0.0)
    rig.wait(5.0)
    assert rig.state.tracking.track == "STOW"


@pytest.mark.long
@pytest.mark.parametrize("outage", OUTAGES)
def test_p4_after_an_outage_in_which_nobody_did_anything_it_holds_again(
    rig: Rig, outage: Callable[[Rig], None]
) -> None:
    outage(rig)
    rig.wait(3.0)
    assert rig.state.tracking.track == "HOLD/FITTED"


def trip_by_crash(rig: Rig) -> None:
    rig.crash(W_TRIPS_S)


def trip_by_line(rig: Rig) -> None:
    rig.fault(f"cut duration_s={W_TRIPS_S}")
    rig.wait(W_TRIPS_S + 1.0)


@pytest.mark.long
@pytest.mark.parametrize("trip", [trip_by_crash, trip_by_line])
def test_p4_after_the_register_watchdog_has_tripped_it_holds_again_within_three_seconds(
    rig: Rig, trip: Callable[[Rig], None]
) -> None:
    for _ in range(2):  # the second time the watchdog's bit stands already
        trip(rig)
        rig.wait(3.0)
        assert rig.acu.status().has_interlock_fault
        assert (rig.state.arming.disarmed_by, rig.state.tracking.track) == ("", "HOLD/FITTED")


@pytest.fixture
def status_without_system_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    """An ACU that shows the watchdog in FAULT DETAIL alone."""

    def status_of(antenna: Any, modes: Any, faults: Faults, **others: Any) -> Status:
        return acu_status.status_of(antenna, modes, replace(faults, system=0), **others)

    monkeypatch.setattr("acu_daemon.sim.acu.status_of", status_of)


@pytest.mark.long
@pytest.mark.usefixtures("status_without_system_faults")
@pytest.mark.parametrize("trip", [trip_by_crash, trip_by_line])
def test_p4_a_watchdog_that_shows_in_the_fault_detail_alone_is_nobodys_stop(
    rig: Rig, trip: Callable[[Rig], None]
) -> None:
    for _ in range(2):
        trip(rig)
        rig.wait(3.0)
        assert not rig.acu.status().has_interlock_fault
        assert (rig.state.arming.disarmed_by, rig.state.tracking.track) == ("", "HOLD/FITTED")


@pytest.mark.long
@pytest.mark.usefixtures("status_without_system_faults")
@pytest.mark.parametrize("trip", [trip_by_crash, trip_by_line])
def test_p1_a_stop_in_a_long_outage_is_respected_once_the_fault_detail_shows_no_watchdog(
    rig: Rig, trip: Callable[[Rig], None]
) -> None:
    meanwhile(rig, "stop")
    trip(rig)
    rig.wait(3.0)
    assert rig.state.arming.disarmed_by == BY_HAND


def test_p1_with_the_watchdogs_bit_still_standing_a_stop_in_a_short_outage_is_respected(rig: Rig) -> None:
    trip_by_line(rig)
    rig.wait(3.0)
    meanwhile(rig, "stop")
    cut(rig)
    rig.wait(3.0)
    assert rig.state.arming.disarmed_by == BY_HAND


def test_p4_our_own_stop_at_the_end_is_nobody_elses(rig: Rig) -> None:
    rig.end_and_run_again()
    rig.wait(10.0)
    assert rig.state.arming.disarmed_by == ""
    assert rig.state.tracking.track in ("HOLD/FITTED", "PREPOSITION")


def test_p4_a_power_cycle_in_an_outage_is_nobodys_stop(rig: Rig) -> None:
    rig.fault("power-cycle start_s=1 duration_s=1")
    dead(rig)
    rig.wait(3.0)
    assert rig.state.arming.disarmed_by == ""


# A disarm is as durable as a latch


@pytest.mark.long
@pytest.mark.parametrize("damage", [b"", b"{", None])
def test_p1_a_disarm_outlives_a_crash_and_a_run_state_that_is_torn_or_gone(rig: Rig, damage: bytes | None) -> None:
    rig.ask("disarm")
    rig.wait(1.0)
    run_state = rig.directory / RUN_STATE
    run_state.unlink() if damage is None else run_state.write_bytes(damage)
    rig.crash(0.0)
    rig.wait(5.0)
    assert (rig.state.is_armed(rig.config), rig.state.arming.disarmed_by) == (False, "a person")
    rig.ask("arm")
    rig.wait(1.0)
    assert not (rig.directory / DISARMED).exists()


@pytest.mark.parametrize("damage", [b"", b"{"])
def test_p1_with_manual_arming_a_run_state_that_is_torn_leaves_it_disarmed(tmp_path: Path, damage: bytes) -> None:
    with Rig(tmp_path, demo_scene(), is_armed=False) as rig:
        rig.wait(1.0)
        rig.ask("arm")
        rig.wait(3.0)
        assert rig.state.is_armed(rig.config)
        (rig.directory / RUN_STATE).write_bytes(damage)
        rig.crash(0.0)
        assert (rig.directory / f"{RUN_STATE}.bad").read_bytes() == damage
        orders = rig.judge.order_count
        rig.wait(5.0)
        assert not rig.state.is_armed(rig.config)
        assert rig.judge.order_count == orders

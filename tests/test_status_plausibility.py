"""Which status is believed: what contradicts itself, or outruns its drive, only when the next one agrees."""

from dataclasses import replace
from pathlib import Path

import pytest
from fake_sky import AZIMUTH, ELEVATION
from flights import (
    DEMO_ANTENNA,
    DEMO_TAI_S,
    climb,
    demo_target,
    events_named,
    flight_of,
    worst_error_deg,
)
from flights import RISING_TAI_S as T
from hypothesis import given
from hypothesis import strategies as st
from memories import Judge
from promise_rig import Rig, demo_scene

from acu_daemon.acu.commands import AcuMode, Backup, SelectBackup, SelectMode, Stow
from acu_daemon.drivers.sa3842.field_status import contradictions, field_status
from acu_daemon.drivers.sa3842.messages import Command, Status
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Scenario

HOLDING = Status(
    az_deg=100.0,
    el_deg=40.0,
    mode=AcuMode.REMOTE_BACKUP,
    backup_selected=Backup.REMOTE,
    is_backup_active=True,
    is_autotrack_selected=True,
    is_remote_enabled=True,
    are_registers_written=True,
)


def told(*statuses: Status, apart_s: float = 0.1) -> list[bool]:
    """Which of them, one after another, are believed."""
    doubt = Judge(AZIMUTH, ELEVATION)
    return [doubt.believes(field_status(status), 1000.0 + i * apart_s) for i, status in enumerate(statuses)]


@pytest.mark.parametrize("el_deg", [-5.0, 40.0, 140.0])
def test_an_azimuth_that_outruns_its_drive_is_doubted_at_any_elevation(el_deg: float) -> None:
    here = replace(HOLDING, el_deg=el_deg)
    assert told(here, replace(here, az_deg=112.0), here) == [True, False, True]


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"mode": AcuMode.MANUAL, "is_backup_active": False, "is_autotrack_selected": False}, "mode and control"),
        ({"is_remote_enabled": False}, "mode and control"),
        ({"is_backup_active": False}, "mode and backup"),
        ({"mode": AcuMode.POSITION_MEMORY}, "mode and backup"),
        ({"mode": AcuMode.REMOTE, "is_backup_active": False}, "mode and autotrack"),
        ({"is_autotrack_selected": False}, "mode and autotrack"),
        ({"mode": AcuMode.FAULT, "is_backup_active": False, "is_autotrack_selected": False}, "mode and fault"),
        ({"are_registers_idle": True}, "mode and registers"),
        ({"is_stow_pin_in": True}, "mode and stow pin"),
    ],
)
def test_what_cannot_be_true_at_once_is_found(change: dict[str, object], found: str) -> None:
    assert contradictions(HOLDING) == ()
    assert contradictions(replace(HOLDING, **change)) == (found,)  # type: ignore[arg-type]


def test_the_simulated_acu_never_contradicts_itself_whatever_happens_to_it() -> None:
    class Rising:
        def direction(self, tai_s: float) -> tuple[float, float, float] | None:
            return None if tai_s % 40.0 > 20.0 else (30.0, 40.0, 1e6)

    acu = FakeAcu(
        AcuParts(AZIMUTH, ELEVATION, 1.0, Rising(), 0.0, Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0)))
    )
    steps: list[Command] = [
        SelectBackup(Backup.REMOTE),
        SelectMode(AcuMode.AUTOTRACK),
        SelectMode(AcuMode.REMOTE),
        SelectMode(AcuMode.AUTOTRACK),
        SelectBackup(Backup.RATE),
        Stow(),
        SelectMode(AcuMode.STANDBY),
    ]
    now_s = 0.0
    for step in steps:
        acu.answer(step)
        for _ in range(130):
            now_s += 0.1
            acu.advance(now_s)
            assert contradictions(acu.status()) == (), (step, acu.status())
    acu.set_local(True, now_s)
    assert contradictions(acu.status()) == ()
    acu.set_local(False, now_s)
    acu.begin_fault("interlock", 0, now_s)
    acu.advance(now_s + 1.0)
    assert contradictions(acu.status()) == ()


def test_one_wild_status_is_left_out_and_the_next_good_one_believed() -> None:
    for wild in (replace(HOLDING, az_deg=190.0), replace(HOLDING, el_deg=60.0), replace(HOLDING, is_stow_pin_in=True)):
        assert told(HOLDING, wild, HOLDING, wild, HOLDING) == [True, False, True, False, True]


def test_an_encoder_that_really_slipped_is_believed_at_the_second_reading() -> None:
    slipped = replace(HOLDING, az_deg=190.0)
    assert told(HOLDING, slipped, slipped, slipped) == [True, False, True, True]


def test_an_acu_that_always_contradicts_itself_is_believed_after_half_a_second_and_from_then_on() -> None:
    odd = replace(HOLDING, is_backup_active=False)
    assert told(*[odd] * 8) == [False, False, False, False, True, True, True, True]
    assert told(odd, odd, odd, odd, HOLDING, odd) == [False, False, False, False, True, False]


def test_two_wild_ones_that_differ_are_both_left_out() -> None:
    assert told(HOLDING, replace(HOLDING, az_deg=190.0), replace(HOLDING, az_deg=20.0)) == [True, False, False]


def test_after_a_silence_an_antenna_may_be_anywhere_its_drive_reaches() -> None:
    assert told(HOLDING, replace(HOLDING, az_deg=190.0), apart_s=4.0) == [True, True]


@pytest.mark.parametrize(
    ("statuses", "apart_s", "is_confirmed"),
    [
        ([HOLDING], 0.1, False),
        ([HOLDING, HOLDING], 0.1, False),
        ([HOLDING] * 3, 0.1, True),
        ([HOLDING] * 3, 4.0, False),
        ([replace(HOLDING, az_deg=190.0), HOLDING, HOLDING], 0.1, False),
        ([HOLDING, HOLDING, replace(HOLDING, az_deg=101.4)], 0.1, False),  # a garbled digit is as little as that
        ([replace(HOLDING, az_deg=190.0), *[HOLDING] * 3], 0.1, False),  # nobody knows which was the garbled one
        ([replace(HOLDING, az_deg=190.0), *[HOLDING] * 5], 0.1, True),
        ([HOLDING, replace(HOLDING, az_deg=190.0), *[HOLDING] * 3], 0.1, True),
        ([replace(HOLDING, az_deg=az_deg) for az_deg in (100.0, 100.15, 100.3)], 0.1, True),  # in autotrack
    ],
)
def test_p2_after_a_silence_a_place_is_sure_once_three_in_a_row_agree(
    statuses: list[Status], apart_s: float, is_confirmed: bool
) -> None:
    doubt = Judge(AZIMUTH, ELEVATION)
    for i, status in enumerate(statuses):
        doubt.believes(field_status(status), 1000.0 + i * apart_s)
    assert doubt.known.is_confirmed is is_confirmed


@given(st.floats(-20.0, 20.0), st.floats(-5.0, 5.0), st.floats(-89.0, 89.0))
def test_no_motion_that_the_drive_can_make_is_doubted(az_deg_s: float, el_deg_s: float, el_deg: float) -> None:
    path = [
        replace(HOLDING, az_deg=(100.0 + 0.1 * az_deg_s * i) % 360.0, el_deg=el_deg + 0.1 * el_deg_s * i)
        for i in range(10)
    ]
    assert all(told(*path))


@pytest.mark.long
def test_through_the_zenith_nothing_is_doubted() -> None:
    flight = flight_of(demo_target(), DEMO_TAI_S, 92.0, antenna=DEMO_ANTENNA, losses=[(50.0, 70.0)], noise_deg=0.05)
    assert not events_named(flight, "acu.doubted")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_loss_is_held_on_a_line_whose_garble_the_check_byte_does_not_see(seed: int) -> None:
    """P5: three replies in ten are changed."""
    flight = climb(
        26.0, losses=[(11.0, 23.0)], faults=[f"xor-blind start_s=12 duration_s=9 probability=0.3 seed={seed}"]
    )
    assert worst_error_deg(flight, T + 12.0, T + 23.0) < 0.1
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


@pytest.mark.long
@pytest.mark.parametrize(
    ("probability", "seed"), [(0.8, 2), (0.8, 13), (0.8, 15), (1.0, 14), (1.0, 16), (1.0, 18), (1.0, 23)]
)
def test_p2_the_first_write_after_an_outage_is_no_garbled_place(tmp_path: Path, probability: float, seed: int) -> None:
    """Replies are garbled so that the check byte fits: one status alone was written before, or two that agreed."""
    with Rig(tmp_path, demo_scene()) as rig:
        rig.wait(6.0)
        rig.fault("silence")
        rig.wait(1.0)
        rig.fault("cut duration_s=3")
        rig.fault(f"xor-blind probability={probability} duration_s=6 seed={seed}")
        rig.wait(8.0)
        assert not rig.judge.broken, rig.judge.broken

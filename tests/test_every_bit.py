"""Every bit of the status block and of FAULT DETAIL alone, in both directions, against docs/protocol.md."""

from dataclasses import fields, replace

import pytest
from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Star

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.drivers.sa3842.codec import ReplyDecoder, ReplyEvent, address_byte, encode_reply
from acu_daemon.drivers.sa3842.messages import Faults, Status
from acu_daemon.drivers.sa3842.status_block import decode_status, encode_status
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Scenario

BITS = {  # nibble: b0, b1, b2, b3
    2: (None, None, "is_backup_active", "is_autotrack_selected"),
    3: ("is_acquired", "is_loss_latched", "is_track_valid", "is_receiver_valid"),
    4: ("is_remote_enabled", "are_registers_written", "are_registers_idle", "has_changed"),
    5: ("has_azimuth_fault", "has_elevation_fault", "has_tilt_fault", "has_interlock_fault"),
    6: ("is_at_cw_limit", "is_at_ccw_limit", "is_azimuth_clamped", "is_sector_high"),
    7: ("is_at_up_limit", "is_at_down_limit", "is_elevation_clamped", "is_stow_pin_in"),
    8: ("is_tilt_fitted", "is_tilt_moving", "is_at_tilt_upper_limit", "is_at_tilt_lower_limit"),
}
ALONE = [(nibble, bit, name) for nibble, names in BITS.items() for bit, name in enumerate(names) if name is not None]
FLAGS = [field.name for field in fields(Status) if field.name.startswith(("is_", "are_", "has_"))]
MODES = {0: "STANDBY", 1: "MANUAL", 2: "REMOTE", 3: "ACQUIRE", 4: "AUTOTRACK", 5: "RATE_MEMORY", 6: "POSITION_MEMORY"}
MODES |= {7: "REMOTE_BACKUP", 8: "STOWING", 9: "STOWED", 15: "FAULT"}
BACKUPS = {0: "RATE", 1: "POSITION", 2: "REMOTE"}
NONE = Status(0.0, 0.0, AcuMode.STANDBY, **dict.fromkeys(FLAGS, False))


def block(nibbles: dict[int, int], angles: str = "000000000000", agc: str = "000") -> str:
    """A status block written by hand: nibbles by their number, characters 30h to 3Fh."""
    return angles + agc + "".join(chr(0x30 + nibbles.get(number, 0)) for number in range(1, 9))


def test_the_table_names_every_flag_of_the_status_once() -> None:
    assert sorted(name for _, _, name in ALONE) == sorted(FLAGS)


@pytest.mark.parametrize(("nibble", "bit", "name"), ALONE, ids=[name for _, _, name in ALONE])
def test_a_bit_alone_is_its_flag_and_no_other_in_both_directions(nibble: int, bit: int, name: str) -> None:
    set_alone = block({nibble: 1 << bit})
    assert decode_status(set_alone) == replace(NONE, **{name: True})
    assert encode_status(replace(NONE, **{name: True})) == set_alone
    whole = {number: sum(1 << b for b, one in enumerate(names) if one) for number, names in BITS.items()}
    cleared_alone = block({**whole, nibble: whole[nibble] & ~(1 << bit)})
    every = replace(NONE, **dict.fromkeys(FLAGS, True))
    assert decode_status(cleared_alone) == replace(every, **{name: False})
    assert encode_status(replace(every, **{name: False})) == cleared_alone


@pytest.mark.parametrize("code", range(16))
def test_a_mode_is_the_one_of_the_table_or_none(code: int) -> None:
    if code not in MODES:
        with pytest.raises(ValueError, match="does not exist"):
            decode_status(block({1: code}))
        return
    assert decode_status(block({1: code})) == replace(NONE, mode=AcuMode[MODES[code]])
    assert encode_status(replace(NONE, mode=AcuMode[MODES[code]])) == block({1: code})


@pytest.mark.parametrize("code", range(4))
@pytest.mark.parametrize("flags", [0, 4, 8, 12])
def test_a_backup_is_the_one_of_the_table_beside_every_flag(code: int, flags: int) -> None:
    if code not in BACKUPS:
        with pytest.raises(ValueError, match="does not exist"):
            decode_status(block({2: code | flags}))
        return
    meant = replace(
        NONE, backup_selected=Backup[BACKUPS[code]], is_backup_active=bool(flags & 4), is_autotrack_selected=flags >= 8
    )
    assert decode_status(block({2: code | flags})) == meant
    assert encode_status(meant) == block({2: code | flags})


@pytest.mark.parametrize("bit", range(16))
def test_a_bit_of_an_angle_alone_is_its_weight_in_its_own_place(bit: int) -> None:
    code, weight_deg = f"{1 << bit:04X}", 360.0 / 65536.0 * (1 << bit)
    signed_deg = weight_deg - 360.0 if bit == 15 else weight_deg
    for place, name, value_deg in ((0, "az_deg", weight_deg), (1, "el_deg", signed_deg), (2, "tilt_deg", signed_deg)):
        angles = "".join(code if k == place else "0000" for k in range(3))
        assert decode_status(block({}, angles)) == replace(NONE, **{name: value_deg})
        assert encode_status(replace(NONE, **{name: value_deg})) == block({}, angles)


@pytest.mark.parametrize("bit", range(12))
def test_a_bit_of_the_agc_alone_is_its_weight(bit: int) -> None:
    text = block({}, agc=f"{1 << bit:03X}")
    assert decode_status(text).agc_db == pytest.approx(0.05 * (1 << bit))
    assert encode_status(replace(NONE, agc_db=0.05 * (1 << bit))) == text


def test_an_address_is_every_character_from_1_to_small_o_and_no_other() -> None:
    taken = []
    for code in range(256):
        try:
            assert address_byte(chr(code)) == code
        except ValueError:
            continue
        taken.append(code)
    assert taken == list(range(0x31, 0x70))
    for text in ("", "11"):
        with pytest.raises(ValueError, match="one character"):
            address_byte(text)


FAULT_DETAIL = 0x3A
FAULT_NIBBLES = ("azimuth", "elevation", "tilt", "encoders", "interlock", "system", "receiver", "reserved")
FAULT_WORDS = {
    **dict.fromkeys(("azimuth", "elevation", "tilt"), ("over-current", "over-temperature", "runaway", "jam")),
    "encoders": ("azimuth encoder", "elevation encoder", "tilt encoder", "reference"),
    "interlock": ("emergency stop", "door", "pedestal power off", "brake"),
    "system": ("memory", "watchdog", "power", "communication"),
    "receiver": ("no AGC", "demodulator"),
}


@pytest.mark.parametrize("place", range(8))
@pytest.mark.parametrize("bit", range(4))
def test_a_bit_of_fault_detail_alone_is_in_its_own_nibble_in_both_directions_and_named(place: int, bit: int) -> None:
    name = FAULT_NIBBLES[place]
    fault = Faults(**{name: 1 << bit})
    frame = encode_reply(FAULT_DETAIL, fault)
    assert bytes(0x30 + (1 << bit if k == place else 0) for k in range(8)) in frame
    assert ReplyDecoder().feed(frame) == [ReplyEvent(FAULT_DETAIL, fault)]
    words = FAULT_WORDS.get(name, ())
    if bit < len(words):
        (text,) = fault.texts()
        assert words[bit] in text
        assert name not in ("azimuth", "elevation", "tilt") or text.startswith(name)
    else:
        assert fault.texts() == ()


LIMITS = ("is_at_cw_limit", "is_at_ccw_limit", "is_at_up_limit", "is_at_down_limit")


@pytest.mark.parametrize(
    ("azimuth_deg", "elevation_deg", "shown"),
    [
        (AZIMUTH.max_deg, 45.0, {"is_at_cw_limit"}),
        (AZIMUTH.min_deg, 45.0, {"is_at_ccw_limit"}),
        (0.0, ELEVATION.max_deg, {"is_at_up_limit"}),
        (0.0, ELEVATION.min_deg, {"is_at_down_limit"}),
        (0.0, 45.0, set()),
    ],
)
def test_at_each_end_of_each_axis_the_simulated_acu_shows_that_limit_switch_alone(
    azimuth_deg: float, elevation_deg: float, shown: set[str]
) -> None:
    scenario = Scenario(acu=AcuChoice(azimuth_deg=azimuth_deg, elevation_deg=elevation_deg))
    acu = FakeAcu(AcuParts(AZIMUTH, ELEVATION, 1.0, Star(), START_TAI_S, scenario))
    acu.advance(START_TAI_S + 1.0)
    assert {name for name in LIMITS if getattr(acu.status(), name)} == shown

"""Every frame of docs/sa3842-vectors.json, both directions."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from acu_daemon.acu.commands import AcuMode, Backup, Identify, Poll, ReadFaults, SelectBackup, SelectMode, Stop, Stow
from acu_daemon.drivers.sa3842.codec import (
    CommandDecoder,
    CommandEvent,
    ReplyDecoder,
    ReplyEvent,
    encode_command,
    encode_reply,
)
from acu_daemon.drivers.sa3842.messages import (
    BACKUP_NUMBERS,
    MODE_NIBBLES,
    Ack,
    ClearChange,
    Command,
    Faults,
    Identity,
    Nak,
    Parameter,
    ReadParameter,
    ReadRegisters,
    RegisterContents,
    Reply,
    ResetFault,
    Status,
    WriteAndPoll,
    WriteParameter,
    WriteRegisters,
)

NUMBERS: dict[object, int] = {**MODE_NIBBLES, **BACKUP_NUMBERS}
VECTORS = json.loads((Path(__file__).parents[1] / "docs" / "sa3842-vectors.json").read_text())
FRAMES = {frame["name"]: bytes.fromhex(frame["hex"]) for frame in VECTORS["frames"]}

AZ_DEG, EL_DEG, TILT_CODE = 123.456, 45.0, 0x04FA
COMMANDS: dict[str, Command] = {
    "IDENT cmd 30h": Identify(),
    "STATUS POLL cmd 31h": Poll(),
    "WRITE REGS az,el (8)": WriteRegisters(AZ_DEG, EL_DEG),
    "WRITE REGS az,el,tilt (12)": WriteRegisters(AZ_DEG, EL_DEG, TILT_CODE),
    "READ REGS cmd 33h": ReadRegisters(),
    "MODE SELECT STANDBY": SelectMode(AcuMode.STANDBY),
    "MODE SELECT REMOTE": SelectMode(AcuMode.REMOTE),
    "MODE SELECT AUTOTRACK": SelectMode(AcuMode.AUTOTRACK),
    "BACKUP SELECT RATE MEM": SelectBackup(Backup.RATE),
    "BACKUP SELECT POSITION MEM": SelectBackup(Backup.POSITION),
    "BACKUP SELECT REMOTE CMD": SelectBackup(Backup.REMOTE),
    "STOW 36h 'ST'": Stow(),
    "STOP 37h": Stop(),
    "CLEAR CHANGE 38h": ClearChange(),
    "FAULT RESET 39h": ResetFault(),
    "FAULT DETAIL 3Ah": ReadFaults(),
    "PARAM READ 3Bh 'R' RMT": ReadParameter("R"),
    "PARAM WRITE 3Ch 'A' AQT 00FA (5 s)": WriteParameter("A", 250),
    "WRITE AND STATUS cmd 41h": WriteAndPoll(AZ_DEG, EL_DEG, TILT_CODE),
}
_CODE_AZ_DEG = 0x57CA * 360 / 65536
_REMOTE = Status(_CODE_AZ_DEG, 45.0, AcuMode.REMOTE, 1274 * 360 / 65536, 2.0, is_tilt_fitted=True)
_LOCKED = Status(
    _CODE_AZ_DEG,
    45.0,
    AcuMode.AUTOTRACK,
    1274 * 360 / 65536,
    15.0,
    is_autotrack_selected=True,
    is_acquired=True,
    is_track_valid=True,
    is_tilt_fitted=True,
)
_RATE_MEMORY = Status(
    0x582E * 360 / 65536,
    0x205B * 360 / 65536,
    AcuMode.RATE_MEMORY,
    1274 * 360 / 65536,
    2.0,
    is_backup_active=True,
    is_autotrack_selected=True,
    is_loss_latched=True,
    has_changed=True,
    is_tilt_fitted=True,
)
_WRITTEN = replace(_REMOTE, are_registers_written=True)
REPLIES: dict[str, tuple[int, Reply]] = {
    "IDENT reply '3842'+'10'": (0x30, Identity("3842", "10")),
    "IDENT reply tilt model '3842'+'20'": (0x30, Identity("3842", "20")),
    "STATUS reply autotrack locked": (0x31, _LOCKED),
    "STATUS reply backup rate memory": (0x31, _RATE_MEMORY),
    "STATUS reply remote mode": (0x31, _REMOTE),
    "WRITE AND STATUS reply": (0x41, _WRITTEN),
    "WRITE REGS ack": (0x32, Ack()),
    "WRITE REGS nak (out of range / local)": (0x32, Nak()),
    "READ REGS reply": (0x33, RegisterContents(_CODE_AZ_DEG, 45.0, TILT_CODE, 0x2A)),
    "MODE SELECT ack": (0x34, Ack()),
    "MODE SELECT nak": (0x34, Nak()),
    "BACKUP ack": (0x35, Ack()),
    "STOW ack": (0x36, Ack()),
    "STOP ack": (0x37, Ack()),
    "CLEAR CHANGE ack": (0x38, Ack()),
    "FAULT RESET ack": (0x39, Ack()),
    "FAULT RESET nak (fault persists)": (0x39, Nak()),
    "FAULT DETAIL reply none": (0x3A, Faults()),
    "FAULT DETAIL az runaway+E-stop": (0x3A, Faults(azimuth=4, interlock=1)),
    "PARAM READ reply 03E8 (20 s)": (0x3B, Parameter("R", 1000)),
    "PARAM WRITE ack": (0x3C, Ack()),
    "unknown cmd reply": (0x5A, Nak()),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_is_encoded_as_its_vector_and_read_back(name: str) -> None:
    assert encode_command(COMMANDS[name]) == FRAMES[name]
    (event,) = CommandDecoder().feed(FRAMES[name], 0.0)
    assert event.command is not None
    assert type(event.command) is type(COMMANDS[name])
    assert encode_command(event.command) == FRAMES[name]


@pytest.mark.parametrize("name", REPLIES)
def test_a_reply_is_encoded_as_its_vector_and_read_back(name: str) -> None:
    cmd, reply = REPLIES[name]
    assert encode_reply(cmd, reply) == FRAMES[name]
    assert ReplyDecoder().feed(FRAMES[name]) == [ReplyEvent(cmd, reply)]


@pytest.mark.parametrize("name", VECTORS["status_decoded"])
def test_the_decoded_status_says_what_the_vectors_say(name: str) -> None:
    (event,) = ReplyDecoder().feed(FRAMES[name])
    names = {
        "mode": "mode",
        "backup_selected": "backup_selected",
        "agc_db": "agc_db",
        "autotrack_selected": "is_autotrack_selected",
        "acquired": "is_acquired",
        "track_valid": "is_track_valid",
        "receiver_valid": "is_receiver_valid",
        "remote_enabled": "is_remote_enabled",
        "tilt_fitted": "is_tilt_fitted",
        "backup_active": "is_backup_active",
        "loss_latched": "is_loss_latched",
        "change": "has_changed",
    }
    for key, value in VECTORS["status_decoded"][name].items():
        decoded = getattr(event.reply, names[key])
        assert NUMBERS.get(decoded, decoded) == value, key


def test_the_unknown_command_is_told_from_silence() -> None:
    assert CommandDecoder().feed(FRAMES["unknown cmd 5Ah -> NAK"], 0.0) == [CommandEvent(0x5A, None)]


def test_a_poll_of_address_two_is_ignored_by_address_one_and_answered_by_two() -> None:
    frame = FRAMES["address 2 poll"]
    assert CommandDecoder().feed(frame, 0.0) == []
    assert CommandDecoder(ord("2")).feed(frame, 0.0) == [CommandEvent(0x31, Poll())]
    assert encode_command(Poll(), ord("2")) == frame


def test_every_vector_is_tested_here() -> None:
    others = {"unknown cmd 5Ah -> NAK", "address 2 poll"}
    assert COMMANDS.keys() | REPLIES.keys() | others == FRAMES.keys()

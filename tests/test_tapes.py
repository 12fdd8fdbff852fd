"""Recorded passes through the daemon's decision code: every command the same, or the first that is not is told."""

import gzip
import json
import time
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import acu_daemon
from fault_tapes import TROUBLES, path_of
from flights import DEMO_ANTENNA, SCD_HIGH_TAI_S, climb, demo_target, flight_of, scd_target

from acu_daemon.assist.session.refit import RefitReply, RefitRequest
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.control.hear import Heard
from acu_daemon.control.orders import Orders
from acu_daemon.control.tick_input import Arrival
from acu_daemon.daemon.area import CommonArea
from acu_daemon.edge.tape import Record
from acu_daemon.edge.tape_file import SUFFIX, read_tape

ROUNDING = 1e-5  # relative: the linear algebra of another kind of processor rounds otherwise, 4e-7 was seen
FLUSH_S = 1.0  # what a daemon that is killed may lose


class States:
    """Notes the states of a replay, and the events of its ticks."""

    def __init__(self) -> None:
        self.states: list[str] = []
        self.events: set[str] = set()
        self.fits: list[RefitReply] = []

    def ticked(self, area: CommonArea, _now_tai_s: float, orders: Orders) -> None:
        if self.states[-1:] != [str(area.state.tracking.track)]:
            self.states.append(str(area.state.tracking.track))
        self.events.update(event.name for event in orders.events)

    def heard(self, _heard: Heard, _arrival: Arrival, _latency_s: float) -> None:
        """Nothing to note."""

    def fitted(self, _request: RefitRequest, reply: RefitReply) -> None:
        self.fits.append(reply)

    def told(self, _record: Record, _now_tai_s: float) -> None:
        """Nothing to note."""


@pytest.mark.long
@pytest.mark.parametrize("name", TROUBLES)
def test_a_recording_with_a_fault_gives_every_command_again(name: str) -> None:
    seen = States()
    done = replay_pass(path_of(name), seen)
    assert (done.difference, done.torn, done.is_whole, done.replay.is_ended) == (None, "", True, True)
    assert [state for state in TROUBLES[name].shows if state not in seen.states] == []
    assert seen.states[-1] == "AUTOTRACK/FITTED"
    assert done.replay.command_count > 140
    assert done.replay.fit_count > 5


def numbers(fit: Any) -> list[float]:
    """All numbers of a fit, in the order of its fields."""
    if is_dataclass(fit):
        return [number for field in fields(fit) for number in numbers(getattr(fit, field.name))]
    if isinstance(fit, tuple | list | np.ndarray):
        return [number for one in fit for number in numbers(one)]
    return [float(fit)] if isinstance(fit, int | float) else []


def test_the_fits_are_computed_again_to_the_same_numbers() -> None:
    recorded, anew = States(), States()
    replay_pass(path_of("silence-of-the-line"), recorded)
    assert replay_pass(path_of("silence-of-the-line"), anew, fits_anew=True).difference is None
    for once_more, one in zip(anew.fits, recorded.fits, strict=True):
        assert numbers(once_more.fit) == pytest.approx(numbers(one.fit), rel=ROUNDING, abs=0.0)
    assert len(numbers(anew.fits[-1].fit)) > 150
    assert len(anew.fits) > 5


def changed(path: Path, to: Path, change: Any) -> Path:
    """The recording with its lines changed."""
    with gzip.open(path, "rt") as file:
        head, *lines = file.read().splitlines()
    with gzip.open(to, "wt") as file:
        file.write("\n".join([head, *change(lines)]) + "\n")
    return to


def test_another_decision_is_told_with_its_first_tick_and_exit_status_1(tmp_path: Path) -> None:
    def otherwise(lines: list[str]) -> list[str]:
        writes = [k for k, line in enumerate(lines) if line.startswith("X") and " 0231" in line and len(line) > 40]
        lines[writes[60]] = lines[writes[60]][:-8] + "31303037"
        return lines

    path = changed(path_of("local-panel"), tmp_path / f"other{SUFFIX}", otherwise)
    done = acu_daemon("replay", "--wire", path)
    assert done.code == 1
    assert "a decision differs at 2026-08-18T12:41:4" in done.err
    assert ": recorded 0231" in done.err
    assert "PointAndPoll" in done.err


def test_the_safe_stop_at_the_end_is_replayed_too(tmp_path: Path) -> None:
    def otherwise(lines: list[str]) -> list[str]:
        end = lines.index("E{}")
        stop = next(k for k in range(end, len(lines)) if lines[k].startswith("X") and lines[k - 1][0] != "Q")
        lines[stop] = lines[stop][:-1] + "f"
        return lines

    path = changed(path_of("local-panel"), tmp_path / f"stop{SUFFIX}", otherwise)
    difference = replay_pass(path).difference
    assert difference is not None
    assert difference.replayed.endswith("(Stop)")


def test_a_recording_of_a_pass_says_that_all_is_the_same() -> None:
    done = acu_daemon("replay", "--wire", path_of("latch"))
    assert (done.code, done.out[:26]) == (0, "every decision is the same")


@pytest.mark.parametrize("more", [["--config", "somewhere"], ["--out", "there.csv"]])
def test_a_recording_has_all_that_it_needs(more: list[str]) -> None:
    done = acu_daemon("replay", "--wire", path_of("latch"), *more)
    assert done.code == 2
    assert "stands alone" in done.err


@pytest.mark.parametrize("share", [0.3, 0.7, 0.99])
def test_a_recording_that_was_cut_anywhere_is_replayed_up_to_there(tmp_path: Path, share: float) -> None:
    packed = path_of("power-cycle").read_bytes()
    cut = tmp_path / f"cut{SUFFIX}"
    cut.write_bytes(packed[: round(share * len(packed))])
    done = replay_pass(cut)
    assert (done.difference, done.torn, done.is_whole) == (None, "", False)
    assert done.replay.tick_count > 10


def test_every_second_can_be_read_before_the_recording_is_closed(tmp_path: Path) -> None:
    path, seen = tmp_path / f"open{SUFFIX}", []

    def look(_access: Any) -> None:
        time.sleep(0.1)  # the writer's thread is no part of the virtual time
        seen.append(read_tape(path))

    climb(6.0, script=[(4.0, look)], tape=path)
    ticks = [record for record in seen[0].records() if record[0] == "T"]
    whole = [record for record in read_tape(path).records() if record[0] == "T"]
    assert not seen[0].is_whole
    assert 4.0 - (ticks[-1][1] - whole[0][1]) < FLUSH_S


def test_a_line_that_makes_no_sense_is_told_with_its_number(tmp_path: Path) -> None:
    path = changed(path_of("latch"), tmp_path / f"torn{SUFFIX}", lambda lines: [*lines[:50], "W?", *lines[50:]])
    done = acu_daemon("replay", "--wire", path)
    assert done.code == 1
    assert "line 52: 'W?'" in done.err


@pytest.mark.parametrize(
    "data", [b"", b"utc,az_deg\n", gzip.compress(b'{"format": 99}\n', mtime=0), gzip.compress(b"[]\n", mtime=0)]
)
def test_what_is_no_recording_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / f"none{SUFFIX}"
    path.write_bytes(data)
    done = acu_daemon("replay", "--wire", path)
    assert done.code == 2
    assert str(path) in done.err


def test_brouwer_elements_and_a_pass_past_the_zenith_are_replayed(tmp_path: Path) -> None:
    path = tmp_path / f"scd{SUFFIX}"
    flight_of(scd_target(SCD_HIGH_TAI_S), SCD_HIGH_TAI_S, 8.0, antenna=DEMO_ANTENNA, tape=path)
    assert replay_pass(path).difference is None


def test_the_head_keeps_what_is_private_to_itself(tmp_path: Path) -> None:
    path = tmp_path / f"own{SUFFIX}"
    climb(2.0, demo_target(hooks={"after_pass": ["/opt/upload", "--password", "secret"]}), tape=path)
    assert "secret" not in json.dumps(read_tape(path).head)

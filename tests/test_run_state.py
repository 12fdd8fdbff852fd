"""P4, P10: run.json is exact and whole, and whatever it holds, a start goes on; what is resumed is not aged."""

import json
import stat
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from drained import drain
from memories import remembering
from structlog.testing import capture_logs
from test_carry_over_file import CARRIED, FIT

from acu_daemon.control.state import ByHand, Held, Nudge
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.edge.run_state import RETRY_TICKS, RUN_STATE, RunState, RunStateKeeper, read_run_state
from acu_daemon.edge.writer import Writer
from acu_daemon.model import Model, Pass

BY_HAND = ByHand(is_held=True, nudge=Nudge(0.1, -0.25, Model.NEW_FIT))
STATE = RunState(
    "ISS (25544)", 1000.0, 1600.0, None, "HOLD/FITTED", True, held=False, fit=CARRIED, by_hand=BY_HAND, elements="TLE"
)
COMING = Pass(1000.2, 1300.0, 1600.1, 10.0, 60.0, 90.0, 170.0)


def written(directory: Path, state: RunState = STATE) -> Path:
    writer = Writer("files")
    keeper = RunStateKeeper(directory, writer, replace(state, track=""), lambda _: None)
    held = None if state.held is None else Held(state.held)
    keeper.see(remembering(track=TrackState(state.track), by_people=state.arming, held=held, by_hand=state.by_hand))
    assert writer.close(60.0)
    return directory / RUN_STATE


def test_p10_what_is_read_is_what_was_written(tmp_path: Path) -> None:
    path = written(tmp_path)
    read = read_run_state(tmp_path)
    assert read.fit is not None
    assert read.fit.is_of_this_pass
    assert (read.fit.covariance == CARRIED.covariance).all()
    assert replace(read, fit=replace(read.fit, is_of_this_pass=False)) == STATE
    assert json.loads(path.read_text())["rise_utc"] == "2000-01-01T12:16:08.000Z"
    assert not stat.S_IMODE(path.stat().st_mode) & stat.S_IWOTH


@pytest.mark.parametrize("is_held", [False, True])
def test_with_other_elements_a_persons_hold_goes_on_and_the_nudge_does_not(is_held: bool) -> None:
    left = replace(STATE, by_hand=replace(BY_HAND, is_held=is_held))
    assert left.by_hand_with("TLE") == left.by_hand
    assert left.by_hand_with("newer") == replace(left.by_hand, nudge=None)


def test_no_file_is_no_complaint(tmp_path: Path) -> None:
    with capture_logs() as logs:
        assert read_run_state(tmp_path) == RunState()
    assert logs == []


def alarm(directory: Path) -> str:
    """What the log says of a file that cannot be used; it is kept aside."""
    text = (directory / RUN_STATE).read_bytes()
    with capture_logs() as logs:
        assert read_run_state(directory) == RunState()
    (log,) = logs
    assert (log["event"], log["log_level"]) == ("run_state.unreadable", "error")
    assert (directory / f"{RUN_STATE}.bad").read_bytes() == text
    assert not (directory / RUN_STATE).exists()
    return str(log["reason"])


@pytest.mark.parametrize("text", [b"", b"[]", b"null", b"{", b"\xff\xfe", b"[" * 100_000, b"9" * 5000, b"\0" * 4096])
def test_p10_a_corrupt_or_foreign_file_is_an_alarm_and_is_kept_aside(tmp_path: Path, text: bytes) -> None:
    (tmp_path / RUN_STATE).write_bytes(text)
    assert alarm(tmp_path)


def test_p10_every_cut_of_a_file_is_an_alarm(tmp_path: Path) -> None:
    path = written(tmp_path)
    whole = path.read_bytes()
    for size in range(0, len(whole) - 1, 97):
        path.write_bytes(whole[:size])
        assert alarm(tmp_path)


def test_p4_a_file_of_an_older_version_that_holds_nothing_of_the_antenna_is_read(tmp_path: Path) -> None:
    path = written(tmp_path)
    old = json.loads(path.read_text())
    for key in ("held", "by_hand", "elements"):
        del old[key]
    path.write_text(json.dumps(old))
    read = read_run_state(tmp_path)
    assert (read.track, read.held, read.is_stow_kept) == ("HOLD/FITTED", None, False)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("version", 2),
        ("arming", "yes"),
        ("held", 0),
        ("is_stow_kept", "no"),
        ("satellite", 7),
        ("rise_tai_s", "soon"),
        ("set_tai_s", float("nan")),
        ("clock_s", []),
        ("fit", {}),
        ("fit", 1),
    ],
)
def test_p10_a_file_with_something_wrong_is_an_alarm(tmp_path: Path, key: str, value: Any) -> None:
    path = written(tmp_path)
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    assert alarm(tmp_path)


@pytest.mark.parametrize(
    ("change", "is_same"),
    [
        (lambda state: state, True),
        (lambda state: replace(state, satellite="other"), False),
        (lambda state: replace(state, rise_tai_s=-5000.0, set_tai_s=-4400.0), False),
        (lambda state: replace(state, clock_s=5.0), False),
        (lambda _: RunState(), False),
    ],
)
def test_only_the_same_pass_of_the_same_satellite_is_gone_on_with(
    change: Callable[[RunState], RunState], is_same: bool
) -> None:
    assert change(STATE).is_of("ISS (25544)", COMING, None) is is_same


@pytest.mark.parametrize(("clock_s", "is_same"), [(5.0, True), (5.9, True), (8.0, False), (None, False)])
def test_another_rehearsal_of_the_pass_is_not_gone_on_with(clock_s: float | None, is_same: bool) -> None:
    assert replace(STATE, clock_s=5.0).is_of("ISS (25544)", COMING, clock_s) is is_same


def test_a_change_is_written_and_a_tick_without_one_is_not(tmp_path: Path) -> None:
    writer = Writer("files")
    keeper = RunStateKeeper(tmp_path, writer, STATE, lambda fit: replace(CARRIED, at_tai_s=fit.at_tai_s))
    state = remembering(track=TrackState.HOLD_FITTED, by_people=True, held=Held(), by_hand=BY_HAND)
    for _ in range(10):
        keeper.see(state)
    drain(writer)
    assert not (tmp_path / RUN_STATE).exists()
    keeper.offer(replace(FIT, at_tai_s=5.0))
    keeper.see(remembering(state, by_people=False))
    assert writer.close(60.0)
    read = read_run_state(tmp_path)
    assert read.fit is not None
    assert (read.arming, read.fit.at_tai_s) == (False, 5.0)


def test_p10_a_full_disk_is_told_at_its_edges(tmp_path: Path) -> None:
    writer = Writer("files")
    gone = tmp_path / "gone"
    keeper = RunStateKeeper(gone, writer, STATE, lambda _: None)

    def see(track: TrackState) -> None:
        keeper.see(remembering(track=track))
        drain(writer)

    with capture_logs() as logs:
        see(TrackState.IDLE)
        see(TrackState.PREPOSITION)
        writer.put(gone.mkdir)
        see(TrackState.ACQUIRE_TLE)
        see(TrackState.HOLD_FITTED)
        assert writer.close(60.0)
    assert [log["event"] for log in logs] == ["run_state.not_saved", "run_state.saved_again"]
    assert read_run_state(gone).track == "HOLD/FITTED"


def test_p10_what_a_full_disk_refused_is_written_again_though_nothing_changes(tmp_path: Path) -> None:
    writer, gone = Writer("files"), tmp_path / "gone"
    keeper = RunStateKeeper(gone, writer, STATE, lambda _: None)
    state = remembering(track=TrackState.HOLD_FITTED, by_people=True)

    def ticks(count: int) -> None:
        for _ in range(count):
            keeper.see(state)
            drain(writer)

    with capture_logs() as logs:
        ticks(1)
        while not keeper.problem:
            pass
        assert keeper.problem == "run.json: No such file or directory"
        ticks(RETRY_TICKS)
        gone.mkdir()
        ticks(RETRY_TICKS)
        assert writer.close(60.0)
    assert [log["event"] for log in logs] == ["run_state.not_saved", "run_state.saved_again"]
    assert read_run_state(gone).arming is True
    assert keeper.problem == ""


@pytest.mark.parametrize(("problem", "count"), [("", 0), ("a full disk", 3)])
def test_p10_what_a_full_disk_refused_is_tried_again_each_second_and_not_each_tick(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, problem: str, count: int
) -> None:
    writer = Writer("files")
    keeper = RunStateKeeper(tmp_path, writer, STATE, lambda _: None)
    state = remembering(track=TrackState.HOLD_FITTED, by_people=True)
    keeper.see(state)
    assert writer.close(60.0)
    offered: list[Any] = []
    monkeypatch.setattr(keeper._latest, "offer", offered.append)
    keeper.problem = problem
    for _ in range(3 * RETRY_TICKS):
        keeper.see(state)
    assert len(offered) == count


@pytest.mark.parametrize(
    ("left_s", "now_s", "is_another"),
    [(5.0, 5.9, False), (5.0, 6.1, True), (None, None, False), (5.0, None, False), (None, 5.0, False)],
)
def test_only_a_rehearsal_can_be_another_one_and_only_where_both_clocks_are_known(
    left_s: float | None, now_s: float | None, is_another: bool
) -> None:
    assert replace(STATE, clock_s=left_s).is_of_another_rehearsal(now_s) is is_another

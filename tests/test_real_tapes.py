"""Recordings of real daemons on the real clock, under losses: replayed bit for bit, also after a SIGKILL."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from script_modules import load

from acu_daemon.cli.replay_wire import ReplayedPass, replay_pass
from acu_daemon.edge.tape_file import SUFFIX, read_tape

pass_rig = load("pass_rig")
pytestmark = pytest.mark.realtime

PATIENCE_S = 90.0
LOST_TICKS = 10  # a second, which a daemon that is killed may lose
LATE_TICKS = 10  # of a machine that does other things too


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Any]:
    """The demo's satellite with its losses; nothing is started yet."""
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as made:
        scenario = made[0].config / "scenario.toml"
        losses = (
            f'[[loss]]\ncause = "receiver"\nstart_s = {start}.0\nduration_s = 2.0\n' for start in range(5, 110, 6)
        )
        scenario.write_text(scenario.read_text().split("[[loss]]")[0] + "".join(losses))
        yield made[0]


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s, "it never came true"
        time.sleep(0.05)


def has_held_and_locked_again(rig: Any) -> bool:
    states = [event["state"] for event in rig.events("state.changed")]
    return "HOLD/FITTED" in states and "AUTOTRACK/FITTED" in states[states.index("HOLD/FITTED") :]


def tape_of(rig: Any) -> Path:
    (path,) = rig.kept.glob(f"passes/*{SUFFIX}")
    return Path(path)


def replayed(rig: Any) -> ReplayedPass:
    done = replay_pass(tape_of(rig))
    assert (done.difference, done.torn) == (None, "")
    assert replay_pass(tape_of(rig), fits_anew=True).difference is None
    return done


def test_a_real_daemon_that_lost_its_signal_is_replayed_bit_for_bit(rig: Any) -> None:
    rig.start_acu()
    rig.start_daemon()
    wait_until(lambda: has_held_and_locked_again(rig))
    rig.daemon.terminate()
    assert rig.daemon.wait(PATIENCE_S) == 0
    done = replayed(rig)
    (told,) = rig.events("run.done")
    assert done.replay.is_ended
    assert done.is_whole
    assert done.replay.fit_count >= told["refit_count"]
    assert done.replay.tick_count >= told["tick_count"]  # with those of the start that follow each other


def test_a_daemon_that_is_killed_loses_no_more_than_a_second_of_its_recording(rig: Any) -> None:
    rig.start_acu()
    rig.start_daemon()
    wait_until(lambda: has_held_and_locked_again(rig))
    wait_until(lambda: len(tape_of(rig).read_bytes()) > 0)
    killed_s = time.monotonic()
    rig.daemon.kill()
    rig.daemon.wait(PATIENCE_S)
    killed_tai_s = rig.scene.start_tai_s + killed_s - rig.at_monotonic_s
    done = replayed(rig)
    last_tai_s = [record[1] for record in read_tape(tape_of(rig)).records() if record[0] == "T"][-1]
    assert not done.is_whole
    assert killed_tai_s - last_tai_s < 0.1 * (LOST_TICKS + LATE_TICKS)

"""`acu-daemon wait` and `status --watch`: what counts as reached, exit statuses, what is drawn of old news."""

import io
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import acu_daemon
from rich.console import Console
from test_live_line import SEEN

from acu_daemon.cli.status_watch import picture
from acu_daemon.cli.wait import wait_for
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.goal import Goal, is_reached
from acu_daemon.daemon.overview import steering
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.errors import AcuDaemonError, NoAcuError, NoDaemonError

HOLDING = replace(SEEN, state="HOLD/FITTED", is_acquired=False, verdict="HOLDING")
BEFORE = replace(SEEN, state="IDLE", is_acquired=False, rise_in_s=600.0, set_in_s=1200.0)
AFTER = replace(BEFORE, rise_in_s=-700.0, set_in_s=-1.0)
CUT_OFF = replace(SEEN, state="LINK-LOST", is_link_up=False)


@pytest.mark.parametrize(
    ("seen", "reached"),
    [
        (SEEN, {Goal.TRACKING, Goal.PASS}),
        (HOLDING, {Goal.PASS}),
        (BEFORE, {Goal.IDLE}),
        (AFTER, {Goal.IDLE}),
        (replace(BEFORE, rise_in_s=None, set_in_s=None), {Goal.IDLE}),
        (replace(BEFORE, rise_in_s=-1.0), {Goal.PASS}),  # up, and not steered yet
        (replace(SEEN, is_link_up=False), {Goal.PASS}),  # what was acquired is not known any more
        (replace(BEFORE, state="STOW"), set()),
    ],
)
def test_a_goal_is_reached_by_what_is_measured(seen: Snapshot, reached: set[Goal]) -> None:
    assert {goal for goal in Goal if is_reached(goal, seen)} == reached


class Daemon:
    """Answers in turn, the last one for ever, on a clock that sleeping moves."""

    def __init__(self, *answers: Snapshot | Exception) -> None:
        self.now_s, self._answers = 100.0, list(answers)
        self._turns: Iterator[Snapshot | Exception] = iter(answers)

    def ask(self) -> Snapshot:
        answer = next(self._turns, self._answers[-1])
        if isinstance(answer, Exception):
            raise answer
        return answer

    def wait(self, goal: Goal, timeout_s: float) -> Snapshot:
        return wait_for(goal, timeout_s, self.ask, lambda: self.now_s, self._sleep)

    def _sleep(self, seconds: float) -> None:
        self.now_s += seconds


def test_waiting_goes_on_through_a_restart_and_ends_when_the_goal_is_reached() -> None:
    daemon = Daemon(HOLDING, NoDaemonError("gone"), NoDaemonError("gone"), CUT_OFF, HOLDING, SEEN)
    assert daemon.wait(Goal.TRACKING, 60.0) is SEEN
    assert daemon.now_s == pytest.approx(102.5)


@pytest.mark.parametrize(
    ("answer", "error", "said"),
    [
        (HOLDING, AcuDaemonError, "not tracking within 3.2 s: HOLDING"),
        (CUT_OFF, NoAcuError, "not tracking within 3.2 s: NO LINK"),
        (NoDaemonError("no daemon runs here"), NoAcuError, "not tracking within 3.2 s: no daemon runs here"),
    ],
)
def test_the_end_of_the_time_says_what_is_there_instead(
    answer: Snapshot | Exception, error: type[Exception], said: str
) -> None:
    daemon = Daemon(answer)
    with pytest.raises(error) as ended:
        daemon.wait(Goal.TRACKING, 3.2)
    assert type(ended.value) is error
    assert str(ended.value).startswith(said)
    assert daemon.now_s == pytest.approx(103.2)


def test_a_daemon_that_may_not_be_asked_is_not_waited_for() -> None:
    daemon = Daemon(AcuDaemonError("not permitted"))
    with pytest.raises(AcuDaemonError, match="not permitted"):
        daemon.wait(Goal.PASS, 60.0)
    assert daemon.now_s == 100.0


def test_scripts_get_an_exit_status(tmp_path: Path) -> None:
    looked = acu_daemon("wait", "tracking", "--timeout", "0", "--state", tmp_path)
    assert looked.code == 3
    assert "no daemon runs" in looked.err
    assert acu_daemon("wait", "flying", "--timeout", "0").code == 2
    assert acu_daemon("wait", "idle", "--timeout", "nan").code == 2


@pytest.mark.long
def test_the_view_is_for_terminals_and_says_what_scripts_take(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "acu_daemon", "status", "--watch", "--state", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    assert (done.returncode, done.stderr) == (
        2,
        "acu-daemon: --watch draws on a terminal; scripts take --json, or `acu-daemon wait`\n",
    )


def drawn(seen: Snapshot, silent_s: float = 0.0, *, has_styles: bool = False) -> str:
    console = Console(
        file=io.StringIO(), width=110, force_terminal=has_styles, color_system="standard" if has_styles else None
    )
    console.print(picture(seen, silent_s))
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert isinstance(text, str)
    return text


def test_the_view_has_the_verdict_on_top_then_what_steers_angles_with_ages_and_the_correction() -> None:
    lines = drawn(replace(SEEN, is_simulation=True, clock_alarm="the clock is not synchronised")).splitlines()
    assert lines[0].startswith("TRACKING for 0:42")
    assert lines[1] == "SIMULATION"
    assert lines[2] == "ALARM  the clock is not synchronised"
    text = "\n".join(lines)
    for part in (
        "the ACU's autotrack; this pass's fit would take over (AUTOTRACK/FITTED)",
        "az 167.43 el 58.01 deg, measured 0.1 s ago",
        "az 167.40 el 58.00 deg, last written",
        "sets in 4:32",
        "1 sigma 0.012 deg; 0.87 s early +0.031 deg across, fit 0 s old",
        "89 s FITTED ahead",
    ):
        assert part in text, part


def test_a_daemon_that_does_not_answer_is_said_and_what_was_seen_is_grey() -> None:
    fresh, old = drawn(SEEN, 0.4, has_styles=True), drawn(SEEN, 12.0, has_styles=True)
    assert "NO ANSWER" not in fresh
    assert "NO ANSWER from the daemon for 0:12" in old.splitlines()[0]
    grey = "\033[2m"
    assert grey in next(line for line in old.splitlines() if "measured" in line)
    assert grey not in next(line for line in fresh.splitlines() if "measured" in line)
    stale = drawn(replace(SEEN, reading_age_s=5.0), has_styles=True)
    assert grey in next(line for line in stale.splitlines() if "measured" in line)


@pytest.mark.parametrize("state", TrackState)
def test_every_state_says_what_steers(state: TrackState) -> None:
    assert steering(replace(SEEN, state=state)).endswith(f"({state})")

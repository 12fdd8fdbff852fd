"""The promises P1 to P10 under any sequence of troubles: a state machine that hypothesis drives and shrinks.

The real daemon runs against the fake ACU in virtual time.  Rules: every fault verb, losses, the local panel, power
cycles, other hands, a person who arms, disarms and clears, steps of the system's clock, a fit process that dies or
hangs, a stall of the whole daemon, a full disk, SIGKILL and SIGTERM with a start from what was saved.  After each of
them every promise is looked at (promise_judge.py).  In the end everything is mended, and the daemon must serve again.

scripts/promises.py --examples N --seed S: the same for longer.
"""

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from promise_judge import SPOILING
from promise_rig import HANDS, Rig, demo_scene

from acu_daemon.sim.fault_verbs import FRAME_VERBS, PEDESTAL_VERBS, VERBS, VerbName

pytestmark = pytest.mark.long

PROMISES = tuple(f"P{number}" for number in range(1, 11))
LINE_VERBS = frozenset(VERBS) - FRAME_VERBS - PEDESTAL_VERBS
PAUSES_S = st.sampled_from([0.1, 0.33, 0.77, 1.5, 4.0])
GARBLING = ("no-reply", "bad-checksum", "xor-blind", "swapped-digits", "truncated", "garbage-before", "garbage-after")
LOCK_S = 8.0  # from the start to a fit
SERVING = ("AUTOTRACK/FITTED", "HOLD/FITTED", "AUTOTRACK/TLE", "HOLD/TLE", "SEARCH")
MENDED_S = 25.0  # from where a runaway left it back to the path


def verbs(names: frozenset[VerbName] | set[VerbName]) -> Any:
    return st.sampled_from(sorted(names))


class Promises(RuleBasedStateMachine):
    """Troubles of one daemon."""

    def __init__(self) -> None:
        super().__init__()
        self.directory = tempfile.TemporaryDirectory(prefix="promises-")
        self.rig: Rig | None = None

    @initialize(is_armed=st.sampled_from([True, True, True, False]), is_locked=st.booleans(), seed=st.integers(1, 3))
    def begin(self, is_armed: bool, is_locked: bool, seed: int) -> None:
        self.rig = Rig(Path(self.directory.name), demo_scene(), is_armed=is_armed, seed=seed)
        self.rig.wait(LOCK_S if is_locked else 0.05)

    @rule(time_s=st.sampled_from([0.1, 0.36, 1.02, 3.0, 10.0]))
    def time_passes(self, time_s: float) -> None:
        self.rig.wait(time_s)

    @rule(
        verb=verbs(FRAME_VERBS),
        duration_s=st.sampled_from([0.2, 1.0, 5.0, None]),
        probability=st.sampled_from([1.0, 0.3]),
        count=st.sampled_from([0, 1, 4]),
        is_of_commands=st.booleans(),
        seed=st.integers(1, 5),
        pause_s=PAUSES_S,
    )
    def frames_suffer(
        self,
        verb: VerbName,
        duration_s: float | None,
        probability: float,
        count: int,
        is_of_commands: bool,
        seed: int,
        pause_s: float,
    ) -> None:
        on = "command" if is_of_commands and verb in GARBLING else "reply"
        lasts = "" if duration_s is None else f" duration_s={duration_s}"
        self.break_it(verb, f"{verb} count={count} probability={probability} on={on} seed={seed}{lasts}", pause_s)

    @rule(verb=verbs(LINE_VERBS), duration_s=st.sampled_from([0.3, 1.0, 5.0, None]), pause_s=PAUSES_S)
    def the_line_fails(self, verb: VerbName, duration_s: float | None, pause_s: float) -> None:
        lasts = "" if duration_s is None else f" duration_s={duration_s}"
        self.break_it(verb, f"{verb}{lasts}", pause_s)

    @rule(verb=st.sampled_from(["stuck", "reversed", "runaway"]), axis=st.sampled_from(["azimuth", "elevation"]))
    def an_axis_fails_in_a_loss(self, verb: VerbName, axis: str) -> None:
        self.rig.fault("silence duration_s=12")
        self.break_it(verb, f"{verb} axis={axis} start_s=0.5 duration_s=8", 7.0)

    @rule(
        verb=verbs(PEDESTAL_VERBS),
        duration_s=st.sampled_from([0.3, 1.0, 5.0, None]),
        axis=st.sampled_from(["azimuth", "elevation", "both"]),
        pause_s=PAUSES_S,
    )
    def the_machine_fails(self, verb: VerbName, duration_s: float | None, axis: str, pause_s: float) -> None:
        lasts = "" if duration_s is None else f" duration_s={duration_s}"
        self.break_it(verb, f"{verb} axis={axis}{lasts}", pause_s)

    def break_it(self, verb: str, text: str, pause_s: float) -> None:
        self.rig.judge.is_spoiled |= verb.startswith(SPOILING)
        self.rig.fault(text)
        self.rig.wait(pause_s)

    @rule(pause_s=PAUSES_S)
    def the_signal_fails_for_a_while(self, pause_s: float) -> None:
        self.rig.fault(f"silence duration_s={3 * pause_s}")
        self.rig.wait(pause_s)

    @rule(pause_s=PAUSES_S)
    def everything_is_mended(self, pause_s: float) -> None:
        self.rig.clear_faults()
        self.rig.wait(pause_s)

    @rule(line=st.sampled_from(["arm", "arm", "disarm", "clear", "status"]), pause_s=PAUSES_S)
    def a_person_asks(self, line: str, pause_s: float) -> None:
        self.rig.ask(line)
        self.rig.wait(pause_s)

    @rule(what=st.sampled_from(sorted(HANDS)), pause_s=PAUSES_S)
    def another_hand(self, what: str, pause_s: float) -> None:
        self.rig.hand(what)
        self.rig.wait(pause_s)

    @rule(by_s=st.sampled_from([-3600.0, -0.5, 0.05, 0.2, 86400.0]), pause_s=PAUSES_S)
    def the_clock_steps(self, by_s: float, pause_s: float) -> None:
        self.rig.step_clock(by_s)
        self.rig.wait(pause_s)

    @rule(trouble=st.sampled_from(["dies", "hangs", ""]), pause_s=PAUSES_S)
    def the_fit(self, trouble: str, pause_s: float) -> None:
        self.rig.fit_trouble = trouble
        self.rig.wait(pause_s)

    @rule(time_s=st.sampled_from([0.06, 0.09, 0.12, 0.17, 2.0]), pause_s=PAUSES_S)
    def the_daemon_stalls(self, time_s: float, pause_s: float) -> None:
        self.rig.stall(time_s)
        self.rig.wait(pause_s)

    @rule(is_full=st.booleans())
    def the_disk(self, is_full: bool) -> None:
        self.rig.fill_disk(is_full)

    @rule(down_s=st.sampled_from([0.0, 0.5, 6.0]), pause_s=PAUSES_S)
    def sigkill(self, down_s: float, pause_s: float) -> None:
        self.rig.crash(down_s)
        self.rig.wait(pause_s)

    @rule(pause_s=PAUSES_S)
    def sigterm(self, pause_s: float) -> None:
        self.rig.end_and_run_again()
        self.rig.wait(pause_s)

    @invariant()
    def the_promises_are_kept(self) -> None:
        if self.rig is not None:
            self.rig.judge.read_files()
            assert not self.rig.judge.broken, self.rig.judge.broken

    def teardown(self) -> None:
        with self.directory:
            if self.rig is not None:
                with self.rig:
                    self._serve_again()

    def _serve_again(self) -> None:
        """Everything is mended, and the daemon is at work again: P2, P3, P4, P9."""
        rig = self.rig
        if rig.judge.broken:
            return
        rig.clear_faults()
        rig.fit_trouble = ""
        rig.fill_disk(False)
        rig.hand("standby")  # out of a stow
        rig.wait(1.0)
        rig.ask("clear")
        rig.ask("arm")
        rig.wait(MENDED_S)
        before = rig.judge.order_count
        rig.wait(1.0)
        rig.judge.read_files()
        assert not rig.judge.broken, rig.judge.broken
        if rig.clock.tai_s() < rig.coming.set_tai_s - 60.0:
            order_count, track = rig.judge.order_count - before, rig.state.tracking.track
            assert order_count >= 9, f"{order_count} orders in a second, {track}, {rig.state}"
            is_waiting = track == "ACQUIRE/TLE" and rig.service._area.sky.fit is None  # on the path of the elements
            assert track in SERVING or is_waiting, track


TestPromises = Promises.TestCase
TestPromises.settings = settings(
    max_examples=20,
    stateful_step_count=15,
    derandomize=True,
    deadline=None,
    suppress_health_check=list(HealthCheck),
    database=None,
)


# What the machine found once


def test_another_connection_is_read_before_it_is_commanded_however_soon_it_came(tmp_path: Path) -> None:
    """P3."""
    with Rig(tmp_path, demo_scene()) as rig:
        rig.wait(LOCK_S)
        for _ in range(3):
            rig.fault("reset")
            rig.wait(1.0)
        assert not rig.judge.broken, rig.judge.broken
        assert rig.state.tracking.track == "AUTOTRACK/FITTED"


def test_a_daemon_that_stalls_for_most_of_a_period_skips_the_tick_that_follows(tmp_path: Path) -> None:
    """P8."""
    with Rig(tmp_path, demo_scene()) as rig:
        rig.wait(LOCK_S)
        for stall_s in (0.06, 0.08, 0.11, 0.19):
            rig.stall(stall_s)
            rig.wait(1.05)
        assert not rig.judge.broken, rig.judge.broken

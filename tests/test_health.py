"""What feeds the service's watchdog, and what does not (P4): work done, never a loop that only turns."""

from dataclasses import replace

from flights import RISING_ANTENNA, RISING_TAI_S, climb
from test_live_line import SEEN

from acu_daemon.daemon.health import FEED_S, Health
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.drivers.sa3842.messages import Command, Identity, ReadParameter, Reply, WriteAndPoll, WriteParameter
from acu_daemon.sim.acu import FakeAcu

ALIVE = "WATCHDOG=1"


def told(*seen: Snapshot) -> list[str]:
    """What systemd hears of these snapshots, the lines of status left out."""
    heard: list[str] = []
    health = Health(heard.append)
    for one in seen:
        health.see(one)
    return [text for text in heard if not text.startswith("STATUS=")]


def ticks(count: int, **per_tick: int) -> list[Snapshot]:
    """Snapshots 0.1 s apart in which counts rise by so much each."""
    rises = {"tick_count": 1, **per_tick}
    return [
        replace(
            SEEN, tai_s=SEEN.tai_s + 0.1 * k, **{name: getattr(SEEN, name) + k * rise for name, rise in rises.items()}
        )
        for k in range(1, count + 1)
    ]


def test_it_is_ready_once_when_the_acu_has_told_where_the_antenna_is() -> None:
    unknown = replace(SEEN, az_deg=None, el_deg=None)
    assert told(unknown) == []
    assert told(unknown, SEEN, *ticks(30)) == ["READY=1"]


def test_p4_answered_exchanges_feed_the_watchdog_twice_a_second() -> None:
    fed = told(*ticks(50, answered_count=1)).count(ALIVE)
    assert fed == round(5.0 / FEED_S)


def test_p4_a_loop_that_turns_without_an_answered_exchange_starves_the_watchdog() -> None:
    served = ticks(20, answered_count=1)
    turning = [replace(served[-1], tai_s=served[-1].tai_s + 0.1 * k, tick_count=120 + k) for k in range(1, 60)]
    fed_count = told(*served).count(ALIVE)
    assert fed_count == 4
    assert told(*served, *turning).count(ALIVE) <= fed_count + 1  # what was answered since it was fed last


def test_p4_with_the_link_down_each_attempt_to_open_it_feeds_the_watchdog_and_nothing_else_does() -> None:
    down = [replace(one, is_link_up=False) for one in ticks(30)]
    tried = [replace(one, attempt_count=k // 10) for k, one in enumerate(down)]
    assert told(*down).count(ALIVE) == 0
    assert told(*tried).count(ALIVE) == 2


class Deaf(FakeAcu):
    """From a moment on it answers polls, and no register write."""

    is_deaf = False

    def answer(self, command: Command) -> Reply | None:
        reply = super().answer(command)
        return None if self.is_deaf and isinstance(command, WriteAndPoll) else reply


def test_p4_polls_after_writes_that_nobody_answers_are_no_work_done() -> None:
    flight = climb(14.0, make_acu=Deaf, script=[(10.0, lambda stage: setattr(stage.acu, "is_deaf", True))])
    done = [seen.answered_count for seen in flight.snapshots if seen.tai_s > RISING_TAI_S + 10.3]
    assert len(done) > 20
    assert len(set(done)) == 1
    assert flight.snapshots[-1].is_link_up


class NoParameters(FakeAcu):
    """Gives no good reply to what concerns its parameters."""

    def answer(self, command: Command) -> Reply:
        reply = super().answer(command)
        return Identity("none", "") if isinstance(command, ReadParameter | WriteParameter) else reply


def test_p4_a_daemon_whose_start_gets_no_further_is_still_alive() -> None:
    """It records and shows; to start it again for ever would help nobody."""
    antenna = replace(RISING_ANTENNA, reply_latency_s=0.002)
    flight = climb(10.0, make_acu=NoParameters, antenna=antenna)
    done = [seen.answered_count for seen in flight.snapshots if seen.tai_s > RISING_TAI_S + 3.0]
    assert len(done) > 60
    assert all(later > before for before, later in zip(done, done[20:], strict=False))

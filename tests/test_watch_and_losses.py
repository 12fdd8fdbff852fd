"""What is gathered of a replay, and the losses found in it: each limit, what is cut, what is counted."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from memories import remembering
from test_tick import AZ_DEG, EL_DEG, NOW, path, status

from acu_daemon.acu.commands import AcuMode, Poll, Stop
from acu_daemon.acu.replies import Commanded, Refused
from acu_daemon.control.hear import Heard
from acu_daemon.control.orders import Event, Orders
from acu_daemon.control.tick_input import Arrival, Observation, Sky
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import Reading, Readings
from acu_daemon.report.pass_losses import losses_of
from acu_daemon.report.pass_watch import PassWatch, SeenReading, seconds_where

STEP = 1e-6
NO_SKY, POLL = Sky(), Poll()


def seen(t_s: float, is_acquired: bool = False, **changes: Any) -> SeenReading:
    one = SeenReading(t_s, 10.0, 20.0, is_acquired, is_acquired, None, "HOLD/TLE", 0.1, None)
    return replace(one, **changes)


# Losses


@pytest.mark.parametrize(("lasts_s", "count"), [(0.2, 0), (0.25 - STEP, 0), (0.25, 1), (0.3, 1)])
def test_a_quarter_of_a_second_is_a_loss_and_less_is_none(lasts_s: float, count: int) -> None:
    readings = [seen(0.0, True), seen(1.0), seen(1.0 + lasts_s), seen(1.5, True)]
    assert len(losses_of(readings)) == count
    assert len(losses_of(readings[:-1])) == count


def test_each_loss_is_its_own_and_they_are_in_their_order() -> None:
    lost = ((1.0, 2.0), (4.0, 4.1), (5.0, 8.0), (9.0, 99.0))
    times = [0.5 + 0.1 * k for k in range(100)]
    found = losses_of([seen(t_s, not any(a - STEP <= t_s < b - STEP for a, b in lost)) for t_s in times])
    assert [one.start_tai_s for one in found] == pytest.approx([1.0, 5.0, 9.0])
    assert [one.length_s for one in found[:2]] == pytest.approx([1.0, 3.0])
    assert [one.relock_s for one in found[:2]] == pytest.approx([0.0, 0.0])
    assert (found[2].length_s, found[2].relock_s) == (None, None)


def test_the_signal_that_came_last_and_stayed_ends_a_loss() -> None:
    readings = [seen(float(k), k in (0, 1, 9)) for k in range(10)]
    for back in (3, 6, 7, 8):
        readings[back] = replace(readings[back], has_signal=True)
    [loss] = losses_of(readings)
    assert (loss.start_tai_s, loss.length_s, loss.relock_s) == (2.0, 4.0, 3.0)


def test_a_signal_all_the_while_ends_a_loss_at_once() -> None:
    readings = [seen(float(k), k in (0, 5), has_signal=True) for k in range(6)]
    [loss] = losses_of(readings)
    assert (loss.length_s, loss.relock_s) == (0.0, 4.0)


@pytest.mark.parametrize(("level_db", "length_s"), [(5.0 - STEP, 2.0), (5.0, 1.0), (5.0 + STEP, 1.0), (None, 2.0)])
def test_a_level_counts_from_three_db_below_the_middle_of_autotracks(level_db: float | None, length_s: float) -> None:
    held = [seen(0.1 * k, True, agc_db=level) for k, level in enumerate((1.0, 8.0, 30.0, None))]
    lost = [seen(1.0, agc_db=-50.0), seen(2.0, agc_db=level_db), seen(3.0, True, agc_db=8.0)]
    [loss] = losses_of([*held, *lost])
    assert loss.length_s == length_s


def test_what_was_followed_is_told_from_the_second_reading_on_the_longest_first() -> None:
    states = ["AUTOTRACK/TLE", "SEARCH", "HOLD/TLE", "HOLD/TLE", "HOLD/TLE", "SEARCH"]
    lost = [seen(1.0 + k, state=state) for k, state in enumerate(states)]
    [loss] = losses_of([seen(0.0, True), *lost, seen(9.0, True)])
    assert loss.followed == (("HOLD/TLE", 0.6), ("SEARCH", 0.4))


def test_the_largest_off_is_of_the_loss_alone_and_of_what_is_known() -> None:
    lost = [seen(1.0 + k, off_path_deg=off) for k, off in enumerate((0.2, None, 0.7, 0.3))]
    around = seen(0.0, True, off_path_deg=9.0), seen(9.0, True, off_path_deg=8.0)
    assert [one.largest_off_deg for one in losses_of([around[0], *lost, around[1]])] == [0.7]
    unknown = [replace(one, off_path_deg=None) for one in lost]
    assert [one.largest_off_deg for one in losses_of([around[0], *unknown])] == [None]


def test_what_was_before_the_first_acquisition_is_no_loss() -> None:
    assert losses_of([seen(float(k)) for k in range(5)] + [seen(5.0, True)]) == []
    assert losses_of([]) == []


# The watch


def test_a_gap_between_readings_counts_for_two_ticks_and_for_the_reading_before_it() -> None:
    times = [0.0, 0.1, 0.2, 0.4, 5.0, 5.1]
    readings = [seen(t_s, k % 2 == 0) for k, t_s in enumerate(times)]
    assert seconds_where(readings, lambda one: True) == pytest.approx(0.7)
    assert seconds_where(readings, lambda one: one.is_acquired) == pytest.approx(0.1 + 0.2 + 0.1)
    assert seconds_where(readings[:1], lambda one: True) == 0.0


def ticked(watch: PassWatch, at: float, track: TrackState = TrackState.IDLE, sky: Sky = NO_SKY, *events: Event) -> None:
    area: Any = SimpleNamespace(state=remembering(track=track), sky=sky)
    watch.ticked(area, at, Orders(Poll(), events=events))
    assert watch.area is area


def test_each_change_of_state_is_kept_and_every_tick() -> None:
    watch = PassWatch()
    for k, track in enumerate(
        (TrackState.IDLE, TrackState.IDLE, TrackState.SEARCH, TrackState.SEARCH, TrackState.IDLE)
    ):
        ticked(watch, float(k), track, Sky(), Event("e", {"n": k}))
    assert watch.states == [(0.0, "IDLE"), (2.0, "SEARCH"), (4.0, "IDLE")]
    assert watch.ticks_tai_s == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert [(at, event.fields["n"]) for at, event in watch.events] == [(float(k), k) for k in range(5)]


def test_the_newest_prediction_is_what_readings_are_held_against() -> None:
    watch, first, second = PassWatch(), path(), replace(path(), sigma_deg=np.arange(910.0))
    for sky in (Sky(prediction=first), Sky(prediction=second), Sky()):
        ticked(watch, NOW, TrackState.SEARCH, sky)
    assert watch.prediction is second


def heard(watch: PassWatch, reply: Any, reading: Reading | None = None, command: Any = POLL) -> None:
    watch.heard(Heard(Observation(), reading), Arrival(command, reply, NOW + 7.0, NOW + 7.01), 0.012)


def test_replies_refusals_and_silences_are_counted_apart() -> None:
    watch = PassWatch()
    heard(watch, None, command=Stop())
    heard(watch, Refused("in local"), command=Stop())
    heard(watch, Commanded(1.0, 2.0))
    assert watch.unanswered_count == 1
    assert watch.latencies_s == [(NOW + 7.0, 0.012)] * 2
    assert watch.refused == [(NOW + 7.0, "Stop", "in local")]
    assert watch.readings == []


@pytest.mark.parametrize(
    ("mode", "is_acquired", "has_signal"),
    [
        (AcuMode.AUTOTRACK, True, True),
        (AcuMode.REMOTE, True, True),
        (AcuMode.REMOTE, False, False),
        (AcuMode.STANDBY, True, False),
    ],
)
def test_a_reading_is_kept_with_its_signal_its_state_and_how_far_it_was_off(
    mode: AcuMode, is_acquired: bool, has_signal: bool
) -> None:
    watch = PassWatch()
    ticked(watch, NOW, TrackState.SEARCH, Sky(prediction=path()))
    ticked(watch, NOW, TrackState.HOLD_TLE)
    reading = Reading(NOW, AZ_DEG, EL_DEG + 0.5, True, 4.5)
    heard(watch, status(mode, is_acquired=is_acquired), reading)
    heard(watch, status(mode), None)  # one that is not believed
    [one] = watch.readings
    assert one == SeenReading(*(NOW, AZ_DEG, EL_DEG + 0.5, has_signal, True, 4.5, "HOLD/TLE", pytest.approx(0.5), None))


def test_without_a_path_or_a_state_a_reading_has_none() -> None:
    watch = PassWatch()
    heard(watch, status(), Reading(NOW, AZ_DEG, EL_DEG, False))
    [one] = watch.readings
    assert (one.state, one.off_path_deg, one.sigma_deg, one.is_acquired) == ("", None, None, False)


@pytest.mark.parametrize(
    ("after_s", "k"), [(-0.6, None), (-0.4, 0), (0.0, 0), (0.4, 0), (0.6, 1), (9.4, 9), (9.6, None), (900.0, None)]
)
def test_a_sigma_is_of_the_nearest_step_within_the_buffer(after_s: float, k: int | None) -> None:
    buffer = replace(path(), sigma_deg=0.5 + np.arange(10.0), step_s=1.0)
    watch = PassWatch(prediction=buffer)
    heard(watch, status(), Reading(buffer.start_tai_s + after_s, AZ_DEG, EL_DEG, True))
    assert watch.readings[0].sigma_deg == (None if k is None else 0.5 + k)


def test_of_a_long_wait_what_was_before_is_left_out_and_the_state_then_is_kept() -> None:
    watch = PassWatch(
        ticks_tai_s=[1.0, 20.0],
        states=[(0.0, "IDLE"), (5.0, "PREPOSITION"), (10.0, "SEARCH"), (15.0, "IDLE")],
        readings=[seen(t_s) for t_s in (9.9, 10.0, 10.1)],
        latencies_s=[(9.9, 0.1), (10.0, 0.2), (10.1, 0.3)],
        refused=[(1.0, "Stop", "why")],
    )
    left = watch.since(10.0)
    assert left.states == [(10.0, "SEARCH"), (15.0, "IDLE")]
    assert watch.since(7.0).states == [(7.0, "PREPOSITION"), (10.0, "SEARCH"), (15.0, "IDLE")]
    assert watch.since(99.0).states == [(99.0, "IDLE")]
    assert [one.tai_s for one in left.readings] == [10.0, 10.1]
    assert left.latencies_s == [(10.0, 0.2), (10.1, 0.3)]
    assert (left.refused, left.ticks_tai_s) == (watch.refused, watch.ticks_tai_s)
    assert watch.since(-1.0).states == watch.states


@pytest.mark.parametrize(("count", "has_fit"), [(0, True), (2, True), (2, False), (0, False)])
def test_what_a_fit_was_given_and_what_it_came_to_are_kept(count: int, has_fit: bool) -> None:
    watch = PassWatch()
    given = Readings.of([Reading(NOW, 1.0, 2.0, True)] * count)
    fit: Any = object()
    request: Any = SimpleNamespace(readings=given, now_tai_s=NOW + 3.0)
    reply: Any = SimpleNamespace(fit=fit if has_fit else None, prediction=replace(path(), spread=(0.1, 0.2)))
    watch.fitted(request, reply)
    assert watch.fitted_readings == ([given] if count else [])
    assert [(one.tai_s, one.fit, one.spread) for one in watch.fits] == (
        [(NOW + 3.0, fit, (0.1, 0.2))] if has_fit else []
    )


def test_notes_are_of_line_clock_fit_and_facts_and_facts_have_their_names() -> None:
    watch = PassWatch()
    records: list[Any] = [("L", "x"), ("C", "y"), ("I", "hook", {"a": 1}), ("E", "z"), ("Z", 1.0, True, ""), ("T", "t")]
    for k, record in enumerate(records):
        watch.told(record, float(k))
    assert watch.notes == [(float(k), record) for k, record in enumerate(records[:5])]
    assert watch.facts == [("hook", {"a": 1})]

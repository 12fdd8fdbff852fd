"""An antenna that another program leads: from its word on, for its time, and what ends it at once; case by case."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from memories import remembering

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState, Slaved
from acu_daemon.control.tick_input import Observation, Sky, SlaveWish, TickInput
from acu_daemon.control.tracking.slaving import ENDED_BY, slaved_point, take_slaving
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.envelope import Envelope

NOW = 1000.0
CONFIG = ControlConfig(Envelope(AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
WISH = SlaveWish(200.0, 30.0, 5.0, "ann")


def after(state: ControlState, *wishes: SlaveWish, config: ControlConfig = CONFIG) -> tuple[Slaved, list[Any]]:
    events: list[Any] = []
    given = TickInput(Observation(requests=wishes), Sky(), NOW)
    return take_slaving(state, given, config, events).slaved, [(one.name, one.fields) for one in events]


def led(until_s: float = NOW + 1.0, *, has_led: bool = True, track: TrackState = TrackState.SLAVED) -> ControlState:
    return remembering(track=track, slaved=Slaved(WISH, until_s, has_led))


@pytest.mark.parametrize(("until_s", "is_over"), [(NOW + 1e-3, False), (NOW, False), (NOW - 1e-3, True)])
def test_a_word_counts_for_its_time_and_no_longer(until_s: float, is_over: bool) -> None:
    slaved, events = after(led(until_s))
    assert slaved == (Slaved() if is_over else Slaved(WISH, until_s, True))
    why = {"by": "ann", "reason": "nothing was said for the time of the lease"}
    assert events == ([("slaved.ends", why)] if is_over else [])


def test_a_word_lasts_from_when_it_is_said_and_the_last_of_a_tick_counts() -> None:
    other = replace(WISH, az_deg=100.0, lasts_s=7.0)
    assert after(remembering(track=TrackState.IDLE), WISH)[0] == Slaved(WISH, NOW + 5.0, has_led=False)
    assert after(led(), WISH, other) == (Slaved(other, NOW + 7.0, has_led=True), [])
    assert after(led(NOW - 9.0), WISH) == (Slaved(WISH, NOW + 5.0, has_led=True), [])


@pytest.mark.parametrize("lasts_s", [0.0, -1.0])
def test_who_says_so_leads_no_more(lasts_s: float) -> None:
    over = SlaveWish(None, None, lasts_s, "")
    assert after(led(), over) == (Slaved(), [("slaved.ends", {"by": "ann", "reason": "the lease is over"})])
    assert after(remembering(), over) == (Slaved(), [])


@pytest.mark.parametrize(
    ("angles", "is_taken"),
    [
        ((None, None), True),
        ((1.0, None), False),
        ((None, 1.0), False),
        ((np.nan, 1.0), False),
        ((1.0, -np.inf), False),
        ((1e5, 0.0), True),
        ((-1e5, 0.0), True),
        ((1.0001e5, 0.0), False),
        ((0.0, -1.0001e5), False),
    ],
)
def test_only_two_angles_or_none_are_a_word(angles: tuple[float | None, float | None], is_taken: bool) -> None:
    wish = SlaveWish(*angles, 5.0, "bob")
    slaved, _ = after(led(), wish)
    assert slaved.wish == (wish if is_taken else WISH)
    point = slaved_point(remembering(slaved=slaved))
    expected = None if slaved.wish is None or slaved.wish.az_deg is None else (slaved.wish.az_deg, slaved.wish.el_deg)
    assert (None if point is None else (point.az_deg, point.el_deg)) == expected
    assert point is None or (point.az_rate_deg_s, point.el_rate_deg_s) == (0.0, 0.0)


@pytest.mark.parametrize("has_led", [False, True])
@pytest.mark.parametrize("track", TrackState)
def test_it_has_led_once_it_is_in_its_state_and_ends_in_those_that_are_nobodys(
    track: TrackState, has_led: bool
) -> None:
    slaved, events = after(led(has_led=has_led, track=track))
    is_start = track is TrackState.LINK_LOST and not has_led
    if track in ENDED_BY and not is_start:
        assert (slaved, events) == (Slaved(), [("slaved.ends", {"by": "ann", "reason": f"the state is {track}"})])
    else:
        assert slaved == Slaved(WISH, NOW + 1.0, has_led or track is TrackState.SLAVED)
        assert events == []


@pytest.mark.parametrize(
    ("memory", "changes", "reason"),
    [
        ({"problem": "azimuth stands"}, {}, "an axis is latched"),
        ({"by_people": False}, {}, "disarmed"),
        ({}, {"is_armed": False}, "disarmed"),
        ({}, {"is_shadow": True}, "disarmed"),
        ({}, {"is_resting": True}, "disarmed"),
        ({"by_people": True}, {"is_armed": False}, ""),
    ],
)
def test_a_latch_and_whatever_disarms_end_it(memory: dict[str, Any], changes: dict[str, Any], reason: str) -> None:
    state = remembering(led(), **memory)
    slaved, events = after(state, config=replace(CONFIG, **changes))
    assert slaved == (Slaved() if reason else Slaved(WISH, NOW + 1.0, has_led=True))
    assert events == ([("slaved.ends", {"by": "ann", "reason": reason})] if reason else [])

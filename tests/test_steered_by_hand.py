"""control.tracking.by_hand: what a person asks for and what it becomes, and where the path is that is steered by."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from memories import remembering
from test_tick import AZ_DEG, AZ_RATE, CONFIG, EL_DEG, NOW, PLAN, SKY, path, ready, saw, status

from acu_daemon.acu.commands import AcuMode
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ByHand, ControlState, Nudge, PathOffset
from acu_daemon.control.tick_input import Asking, HoldWish, NudgeWish, Request, Sky, StowBy, StowWish, TickInput
from acu_daemon.control.tracking.by_hand import by_hand_before, nudge_in_force, steer_by_hand, steered_point
from acu_daemon.control.tracking.causes import path_point
from acu_daemon.control.tracking.path_offset import OFFSET_STATES
from acu_daemon.control.tracking.state_table import TRACKING, TrackState
from acu_daemon.control.tracking.track_frame import beside
from acu_daemon.model import Model

S = TrackState
NEW_FIT = replace(path("FITTED"), model=Model.NEW_FIT)
NO_PATH = Sky(None, None, PLAN)
OURS = ByHand(True, Nudge(1.5, -0.25, Model.ELEMENTS))


def steer(
    by_hand: ByHand, *requests: Asking, sky: Sky = NO_PATH, config: ControlConfig = CONFIG
) -> tuple[ControlState, list[Event], ControlState]:
    events: list[Event] = []
    state = remembering(ready(S.HOLD_TLE, status(AcuMode.REMOTE_BACKUP)), by_hand=by_hand)
    given = TickInput(saw(status(), requests=requests), sky, NOW)
    return steer_by_hand(state, given, config, events), events, state


# A hold


@pytest.mark.parametrize("is_held", [False, True])
@pytest.mark.parametrize("is_wanted", [False, True])
@pytest.mark.parametrize("nudge", [None, Nudge(1.0, 2.0, Model.ELEMENTS)])
def test_a_hold_begins_and_ends_as_it_is_asked_for_and_is_told_once(
    is_held: bool, is_wanted: bool, nudge: Nudge | None
) -> None:
    after, events, before = steer(ByHand(is_held, nudge), HoldWish(is_wanted))
    assert after.by_hand == ByHand(is_wanted, nudge)
    assert events == ([] if is_held is is_wanted else [Event("hold.begins" if is_wanted else "hold.ends")])
    assert (after is before) is (is_held is is_wanted)
    assert steer(ByHand(is_held), HoldWish(), HoldWish(False))[0].by_hand == ByHand(False)


# A nudge


@pytest.mark.parametrize("before", [None, Nudge(9.0, 9.0), Nudge(9.0, 9.0, Model.LAST_PASS)])
@pytest.mark.parametrize(("along_s", "across_deg"), [(1.5, 0.0), (0.0, -0.25), (-1.5, 0.25), (0.0, 0.0)])
@pytest.mark.parametrize("is_held", [False, True])
def test_a_nudge_replaces_the_one_before_it_and_keeps_its_model_and_none_at_all_ends_it(
    before: Nudge | None, along_s: float, across_deg: float, is_held: bool
) -> None:
    after, events, _ = steer(ByHand(is_held, before), NudgeWish(along_s, across_deg))
    model = before.model if before else None
    is_none = (along_s, across_deg) == (0.0, 0.0)
    assert after.by_hand == ByHand(is_held, None if is_none else Nudge(along_s, across_deg, model))
    assert events == [Event("nudge", {"along_s": along_s, "across_deg": across_deg})]


def test_who_asks_for_something_else_changes_nothing_of_the_path() -> None:
    after, events, before = steer(OURS, Request.DISARM, StowWish(StowBy.OPERATOR))
    assert (after is before, events) == (True, [])
    everything = (NudgeWish(0.5, 0.0), HoldWish(False), Request.ARM)
    assert steer(OURS, *everything)[0].by_hand == ByHand(False, Nudge(0.5, 0.0, Model.ELEMENTS))


def test_a_shadow_takes_no_wish_and_knows_the_model_of_a_nudge_all_the_same() -> None:
    shadow = replace(CONFIG, is_shadow=True)
    after, events, before = steer(OURS, HoldWish(False), NudgeWish(3.0, 3.0), config=shadow)
    assert (after is before, events) == (True, [])
    assert steer(OURS, sky=replace(SKY, prediction=NEW_FIT), config=shadow)[0].by_hand == ByHand(True)


# Its model


def test_a_nudge_belongs_to_the_first_model_that_it_is_used_with_and_ends_with_it() -> None:
    fresh = ByHand(True, Nudge(1.5, -0.25))
    after, events, before = steer(fresh)
    assert (after is before, events) == (True, [])
    after, events, _ = steer(fresh, sky=SKY)
    assert (after.by_hand, events) == (OURS, [])
    after, events, before = steer(OURS, sky=SKY)
    assert (after is before, events) == (True, [])
    after, events, _ = steer(OURS, sky=replace(SKY, prediction=NEW_FIT))
    assert after.by_hand == ByHand(True)
    assert events == [Event("nudge.ends", {"along_s": 1.5, "across_deg": -0.25, "path": "new fit"})]
    after, events, before = steer(ByHand(True), sky=replace(SKY, prediction=NEW_FIT))
    assert (after is before, events) == (True, [])


def test_what_a_person_had_changed_is_gone_on_with_after_a_restart() -> None:
    nudge = Nudge(1.0, 2.0)
    assert by_hand_before() == ByHand()
    assert by_hand_before(is_held=True, nudge=nudge) == ByHand(True, nudge)


@pytest.mark.parametrize("track", TrackState)
def test_a_nudge_is_in_force_while_a_path_is_tracked_but_in_no_search_crossing_or_false_lock(track: TrackState) -> None:
    state = remembering(ready(track, status()), nudge=Nudge(1.0, 2.0))
    is_in_force = track in TRACKING and track not in (S.SEARCH, S.ZENITH, S.FALSE_LOCK)
    assert nudge_in_force(state) == (Nudge(1.0, 2.0) if is_in_force else None)
    assert nudge_in_force(ready(track, status())) is None


# Where the path is

T = NOW + 3.0
OFFSET = PathOffset(-2.0, 0.5, Model.ELEMENTS)
DOWN_TO_EARTH = np.full(path().az_deg.size, 7.0)


def steered(
    sky: Sky = SKY, at_tai_s: float = T, *, follow: bool = False, track: TrackState = S.HOLD_TLE, **changes: Any
) -> Any:
    return steered_point(remembering(ready(track, status()), **changes), sky, at_tai_s, follow=follow)


@pytest.mark.parametrize("follow", [False, True])
def test_a_path_that_nobody_moved_is_as_predicted(follow: bool) -> None:
    other = replace(SKY, prediction=replace(path(), follow_az_deg=path().az_deg + DOWN_TO_EARTH))
    for sky in (SKY, other, NO_PATH, Sky(path(), None, None)):
        for at_tai_s in (T, PLAN.start_tai_s - 50.0):
            assert steered(sky, at_tai_s, follow=follow) == path_point(sky, at_tai_s, follow=follow)
    moved = {"nudge": Nudge(1.0, 1.0), "offset": OFFSET}
    assert steered(NO_PATH, follow=follow, **moved) == path_point(NO_PATH, T, follow=follow)
    assert steered(follow=follow, track=S.SEARCH, **moved) == path_point(SKY, T, follow=follow)
    assert steered(other, follow=True).az_deg - steered(other).az_deg == 7.0


@pytest.mark.parametrize("follow", [False, True])
@pytest.mark.parametrize("track", [S.HOLD_TLE, S.AUTOTRACK_TLE, S.HOLD_FITTED, S.PROGRAM, S.ZENITH])
@pytest.mark.parametrize("nudge", [None, Nudge(1.5, -0.25), Nudge(0.0, 0.25), Nudge(1.5, 0.0)])
@pytest.mark.parametrize("offset", [None, OFFSET])
def test_the_path_is_moved_by_what_autotrack_showed_and_what_a_person_wants_together(
    follow: bool, track: TrackState, nudge: Nudge | None, offset: PathOffset | None
) -> None:
    along_s = across_deg = 0.0
    if offset is not None and track in OFFSET_STATES:
        along_s, across_deg = offset.along_s, offset.across_deg
    if nudge is not None and track is not S.ZENITH:
        along_s, across_deg = along_s + nudge.along_s, across_deg + nudge.across_deg
    sky = replace(SKY, prediction=replace(path(), follow_az_deg=path().az_deg + DOWN_TO_EARTH))
    found = steered(sky, follow=follow, track=track, nudge=nudge, offset=offset)
    turned_deg = 7.0 if follow else 0.0
    if (along_s, across_deg) == (0.0, 0.0):
        assert found.az_deg == pytest.approx(AZ_DEG + 3.0 * AZ_RATE + turned_deg)
    expected = beside(sky.prediction, T, (along_s, across_deg), follow=follow)
    assert (found.az_deg, found.el_deg) == pytest.approx((expected.az_deg, expected.el_deg))
    rates = (found.az_rate_deg_s, found.el_rate_deg_s)
    assert rates == pytest.approx((expected.az_rate_deg_s, expected.el_rate_deg_s), abs=1e-6)
    if across_deg == 0.0:
        assert found.el_deg == pytest.approx(EL_DEG + 0.3 * (3.0 - along_s))


STARTING = replace(PLAN, start_tai_s=NOW + 2.0)


@pytest.mark.parametrize("follow", [False, True])
@pytest.mark.parametrize(("at_s", "is_before"), [(-0.5, True), (2.0 - 0.01, True), (2.0, False), (2.5, False)])
def test_before_its_start_a_nudged_path_stands_still_beside_its_first_point(
    at_s: float, is_before: bool, follow: bool
) -> None:
    sky = Sky(replace(path(), follow_az_deg=path().az_deg + DOWN_TO_EARTH), None, STARTING)
    found = steered(sky, NOW + at_s, follow=follow, nudge=Nudge(1.5, -0.25))
    expected = beside(sky.prediction, NOW + (2.0 if is_before else at_s), (1.5, -0.25), follow=follow)
    if is_before:
        expected = replace(expected, az_rate_deg_s=0.0, el_rate_deg_s=0.0)
    assert found == expected
    no_plan = Sky(sky.prediction, None, None)
    assert steered(no_plan, NOW + at_s, follow=follow, nudge=Nudge(0.5, 0.0)) == beside(
        no_plan.prediction, NOW + at_s, (0.5, 0.0), follow=follow
    )


def test_a_path_that_autotrack_showed_moves_also_before_its_start() -> None:
    found = steered(Sky(path(), None, STARTING), NOW + 1.0, nudge=Nudge(1.5, -0.25), offset=OFFSET)
    assert found == beside(path(), NOW + 1.0, (-0.5, 0.25))


def test_where_the_buffer_does_not_reach_the_path_beside_is_as_predicted_and_before_the_start_none() -> None:
    far = Nudge(50.0, 0.0)
    assert steered(nudge=far) == path_point(SKY, T)
    assert steered(Sky(path(), None, STARTING), NOW, nudge=far) is None
    turned = Sky(replace(path(), follow_az_deg=path().az_deg + DOWN_TO_EARTH), None, PLAN)
    for follow in (False, True):
        assert steered(turned, follow=follow, nudge=far) == path_point(turned, T, follow=follow)

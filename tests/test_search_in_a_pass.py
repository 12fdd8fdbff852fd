"""control.tracking.search: a search within the tick, begun, gone on with, kept and told; its scan does the rest."""

from dataclasses import replace
from typing import Any

import pytest
from memories import remembering
from test_search import CONFIG, PATH
from test_tick import status

from acu_daemon.acu.commands import AcuMode
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, Scan, Search
from acu_daemon.control.tick_input import Observation, Sky, TickInput
from acu_daemon.control.tracking.scan import covered_text, go_on, needed_s, place
from acu_daemon.control.tracking.search import forget_search, search
from acu_daemon.control.tracking.state_table import AUTOTRACKING, TrackState
from acu_daemon.control.tracking.track_frame import beside
from acu_daemon.model import Model, Prediction, Reading

NOW = 100.0
READ_S = NOW - 0.09
S = TrackState
OTHERS = sorted(set(TrackState) - {S.SEARCH})
COVERED = Scan(Model.ELEMENTS, ((0, (-2.0, 2.0)),), 0, 1, 2.0, is_aimed=True)
WIDE = replace(PATH, spread=(6.0, 1.0))  # 18 s and 3 deg of three sigma
ALL = tuple((row, (-30.0, 30.0)) for row in range(-9, 10))
EDGE = Scan(Model.ELEMENTS, (*ALL[:9], (0, (-30.0, 9.94)), *ALL[10:]), 0, 1, 9.94, is_aimed=True)


def memory(track: TrackState, scan: Scan, scanned_s: float = READ_S - 0.1, *, is_read: bool = True) -> ControlState:
    """The antenna at the place of the scan."""
    point = beside(PATH, READ_S, place(scan, CONFIG))
    reading = Reading(READ_S, point.az_deg % 360.0, point.el_deg, is_locked=False)
    values: dict[str, Any] = {"status": status(AcuMode.ACQUIRE), "reading": reading if is_read else None}
    return remembering(track=track, search=Search(scan, scanned_s), **values)


def step(
    before: TrackState,
    state: ControlState,
    *,
    prediction: Prediction | None = PATH,
    config: ControlConfig = CONFIG,
    is_in_step: bool = True,
) -> tuple[ControlState, list[Event]]:
    events: list[Event] = []
    seen = Observation(is_in_step=is_in_step)
    given = TickInput(seen, Sky(prediction), NOW)
    return search(remembering(state, track=before), state, given, config, events), events


def grown(state: ControlState, dt_s: float, scan: Scan | None = None, path: Prediction = PATH) -> Scan:
    scan = scan or state.search.scan
    assert state.intake.reading is not None
    return go_on(scan, path, state.intake.reading, NOW, dt_s, CONFIG)


# The end


@pytest.mark.parametrize("track", OTHERS)
def test_a_search_that_ends_tells_what_it_covered_and_whether_it_has_found(track: TrackState) -> None:
    state = memory(track, COVERED)
    after, events = step(S.SEARCH, state)
    is_found = track in AUTOTRACKING
    fields = {"covered": covered_text(COVERED, PATH, CONFIG), "is_found": is_found}
    assert events == [Event("search.ended", fields)]
    assert after == (remembering(state, search=Search(Scan(), READ_S - 0.1)) if is_found else state)
    without, _ = step(S.SEARCH, state, prediction=None)
    assert without == after


@pytest.mark.parametrize("track", OTHERS)
def test_what_was_covered_is_kept_in_other_states_until_autotrack_has_the_satellite(track: TrackState) -> None:
    state = memory(track, COVERED)
    after, events = step(track, state)
    assert (after.search.scan, events) == (Scan() if track in AUTOTRACKING else COVERED, [])
    bare = memory(track, Scan())
    assert step(track, bare)[0] is bare


def test_forgotten_a_search_begins_at_the_path_and_knows_its_newest_reading() -> None:
    assert forget_search(memory(S.SEARCH, COVERED)).search == Search(Scan(), READ_S - 0.1)


# The begin


@pytest.mark.parametrize("before", OTHERS)
@pytest.mark.parametrize("scan", [Scan(), COVERED])
@pytest.mark.parametrize("scanned_s", [READ_S - 0.1, READ_S, -1e9])
def test_a_search_begins_where_the_last_one_was_and_aims_anew(before: TrackState, scan: Scan, scanned_s: float) -> None:
    state = memory(S.SEARCH, scan, scanned_s)
    after, events = step(before, state)
    assert after.search == Search(grown(state, 0.0, replace(scan, is_aimed=False)), READ_S)
    assert [one.name for one in events] == ["search.begins"]
    assert step(before, state, is_in_step=False)[0] == after


@pytest.mark.parametrize("scan", [Scan(), COVERED])
@pytest.mark.parametrize("path", [PATH, WIDE])
def test_a_begin_tells_what_is_to_be_covered_and_how_long_that_takes(scan: Scan, path: Prediction) -> None:
    _, (event,) = step(S.HOLD_TLE, memory(S.SEARCH, scan), prediction=path, config=replace(CONFIG, search_s=9e9))
    keys_s, all_s = needed_s(scan, path, NOW, CONFIG)
    sigma = "+-18.0 s, +-3.0 deg" if path is WIDE else "+-10.0 s, +-2.0 deg"
    assert event.fields == {
        "covered": covered_text(scan, path, CONFIG),
        "keys": f"+-10 s, +-2 deg: {keys_s:.0f} s to go",
        "three_sigma": f"{sigma}: {all_s:.0f} s to go",
        "search_s": 9e9,
    }
    assert not event.is_warning
    assert (all_s > keys_s + 5.0) is (path is WIDE)


@pytest.mark.parametrize("side", [-0.01, 0.0, 0.01])
def test_a_search_that_has_too_little_time_says_so_and_warns_where_it_is_too_little_for_the_keys(side: float) -> None:
    keys_s, all_s = needed_s(Scan(), WIDE, NOW, CONFIG)
    reason = "search_s is not enough for all: along the track comes first, the rest in the next search"
    for limit_s, is_warning in ((keys_s, side < 0.0), (all_s, False)):
        config = replace(CONFIG, search_s=limit_s + side)
        _, (event,) = step(S.HOLD_TLE, memory(S.SEARCH, Scan()), prediction=WIDE, config=config)
        is_short = limit_s == keys_s or side < 0.0
        assert event.fields.get("reason") == (reason if is_short else None)
        assert event.is_warning is is_warning


# On it goes


@pytest.mark.parametrize(
    ("gap_s", "counted"),
    [(0.1, True), (0.299, True), (0.301, False), (1e9, False)],
)
def test_a_search_goes_on_by_the_time_between_readings_unless_it_is_too_long(gap_s: float, counted: bool) -> None:
    state = memory(S.SEARCH, COVERED, READ_S - gap_s)
    after, events = step(S.SEARCH, state)
    dt_s = READ_S - (READ_S - gap_s) if counted else 0.0
    assert (after.search, events) == (Search(grown(state, dt_s), READ_S), [])
    assert (after.search.scan.along_s > COVERED.along_s + 0.01) is counted


@pytest.mark.parametrize(
    "how", ["the same reading", "no prediction", "no reading", "a reading that may be of another time"]
)
def test_a_search_stands_without_a_new_reading_of_a_known_time_or_a_path(how: str) -> None:
    scanned_s = READ_S if how == "the same reading" else READ_S - 0.1
    state = memory(S.SEARCH, COVERED, scanned_s, is_read=how != "no reading")
    after, events = step(
        S.SEARCH,
        state,
        prediction=None if how == "no prediction" else PATH,
        is_in_step=how != "a reading that may be of another time",
    )
    assert (after is state, events) == (True, [])
    if how in ("no reading", "no prediction"):
        assert step(S.HOLD_TLE, state, prediction=None if how == "no prediction" else PATH) == (state, [])


def test_all_covered_it_begins_again_and_says_so_once() -> None:
    state = memory(S.SEARCH, EDGE)
    state = remembering(state, search=Search(replace(EDGE, along_s=9.98), READ_S - 0.1))
    point = beside(PATH, READ_S, (9.98, 0.0))
    state = remembering(state, reading=Reading(READ_S, point.az_deg % 360.0, point.el_deg, is_locked=False))
    after, events = step(S.SEARCH, state)
    assert after.search == Search(Scan(Model.ELEMENTS, round_count=1), READ_S)
    fields = {"covered": covered_text(EDGE, PATH, CONFIG), "action": "begun again"}
    assert events == [Event("search.covered", fields, is_warning=True)]
    assert step(S.SEARCH, remembering(after, scanned_tai_s=READ_S - 0.1))[1] == []

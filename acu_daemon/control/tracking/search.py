"""SEARCH within the tick: the scan goes on while the state lasts, is kept beyond it, and is told.  Pure.

Owner of `Search`.
"""

from dataclasses import replace

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, Scan, Search
from acu_daemon.control.tick_input import TickInput
from acu_daemon.control.tracking.scan import covered_text, go_on, needed_s
from acu_daemon.control.tracking.state_table import AUTOTRACKING, TrackState
from acu_daemon.control.tracking.track_frame import extents
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Prediction

LONGEST_STEP_S = 0.3  # after a gap in the readings nobody knows what was seen


def search(
    before: ControlState, state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Move the scan on; before: the memory one tick ago.

    A search without success goes on where it was when it comes again.  Once the satellite was found it is a new one.
    """
    prediction, now_tai_s = given.sky.prediction, given.now_tai_s
    was_searching, is_searching = before.tracking.track is TrackState.SEARCH, state.tracking.track is TrackState.SEARCH
    if was_searching and not is_searching:
        fields = {
            "covered": covered_text(state.search.scan, prediction, config),
            "is_found": state.tracking.track in AUTOTRACKING,
        }
        events.append(Event("search.ended", fields))
    if state.tracking.track in AUTOTRACKING:
        return forget_search(state) if state.search.scan != Scan() else state
    reading = state.intake.reading
    if not is_searching or prediction is None or reading is None:
        return state
    if not was_searching:
        state = with_parts(state, search=Search(replace(state.search.scan, is_aimed=False), reading.tai_s))
        events.append(_begins(state.search.scan, prediction, now_tai_s, config))
    dt_s = reading.tai_s - state.search.scanned_tai_s
    if was_searching and (dt_s == 0.0 or not given.seen.is_in_step):
        return state
    scan = go_on(state.search.scan, prediction, reading, now_tai_s, dt_s if dt_s < LONGEST_STEP_S else 0.0, config)
    if scan.round_count > state.search.scan.round_count:
        fields = {"covered": covered_text(state.search.scan, prediction, config), "action": "begun again"}
        events.append(Event("search.covered", fields, is_warning=True))
    return with_parts(state, search=Search(scan, reading.tai_s))


def forget_search(state: ControlState) -> ControlState:
    """The next search begins at the path."""
    return with_parts(state, search=replace(state.search, scan=Scan()))


def _begins(scan: Scan, prediction: Prediction, now_tai_s: float, config: ControlConfig) -> Event:
    """What will be looked at, and whether search_s is enough for it."""
    along_s, across_deg = extents(prediction, config)
    keys_s, all_s = needed_s(scan, prediction, now_tai_s, config)
    fields = {
        "covered": covered_text(scan, prediction, config),
        "keys": f"+-{config.search_along_s:g} s, +-{config.search_across_deg:g} deg: {keys_s:.0f} s to go",
        "three_sigma": f"+-{along_s:.1f} s, +-{across_deg:.1f} deg: {all_s:.0f} s to go",
        "search_s": config.search_s,
    }
    if all_s > config.search_s:
        fields["reason"] = "search_s is not enough for all: along the track comes first, the rest in the next search"
    return Event("search.begins", fields, is_warning=keys_s > config.search_s)

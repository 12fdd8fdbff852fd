"""The skyline: rise and set by it, a hill in mid-pass is no loss, and nothing is searched behind it."""

from dataclasses import replace

import numpy as np
import pytest
from flights import demo_target, events_named, flight_of, rows_between, seconds_to_state, state_at, worst_error_deg

from acu_daemon.cli.options import coming_pass
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.orbit.visibility import why_none
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.pointing.outage import kept_out
from acu_daemon.pointing.skyline import skyline_of
from acu_daemon.schedule.pass_track import track_of
from acu_daemon.schedule.rules import SatelliteRules
from acu_daemon.sim.scenario import AcuChoice

LOW_TAI_S = tai_from_utc("2026-08-19T01:09:00Z")  # before a pass from azimuth 338 over 279, 22 deg high, to 220
HILLS = ((220.0, 9.0), (246.0, 9.0), (250.0, 30.0), (262.0, 30.0), (266.0, 2.0), (330.0, 2.0), (338.0, 8.0))
TARGET = demo_target(envelope={"mask": HILLS}, fallback={"hold_s": 3.0, "acquire_s": 8.0, "search_s": 10.0})
PROPAGATOR, SITE = TARGET.elements.propagator, TARGET.station.site


def test_a_pass_rises_and_sets_by_the_skyline_and_knows_when_it_is_behind_a_hill() -> None:
    [plain] = find_passes(PROPAGATOR, replace(SITE, skyline=None), LOW_TAI_S, LOW_TAI_S + 900.0, 5.0)
    [found] = find_passes(PROPAGATOR, SITE, LOW_TAI_S, LOW_TAI_S + 900.0, 5.0)
    tai_s = np.arange(plain.rise_tai_s, plain.set_tai_s, 0.05)
    seen = apparent_at(PROPAGATOR, tai_s, SITE)
    over = seen.el_deg - np.interp(seen.az_deg, [az for az, _ in HILLS], [el for _, el in HILLS], period=360.0)
    edges = tai_s[1:][(over[1:] >= 0.0) != (over[:-1] >= 0.0)]
    assert len(edges) == 4
    [(hides, shows)] = found.hidden_tai_s
    assert (found.rise_tai_s, hides, shows, found.set_tai_s) == pytest.approx(edges, abs=0.06)
    assert found.rise_tai_s > plain.rise_tai_s + 10.0
    assert found.set_tai_s < plain.set_tai_s - 10.0
    assert found.culmination_el_deg == pytest.approx(plain.culmination_el_deg, abs=1e-3)
    assert not plain.hidden_tai_s


def test_a_pass_that_never_comes_over_the_skyline_is_none_and_it_is_said() -> None:
    walled = replace(SITE, skyline=skyline_of(((0.0, 60.0),)))
    assert find_passes(PROPAGATOR, walled, LOW_TAI_S, LOW_TAI_S + 900.0, 5.0) == []
    said = why_none(PROPAGATOR, walled, LOW_TAI_S, LOW_TAI_S + 900.0, 5.0)
    assert said == "all of its passes above 5 deg are behind the mask, 1 of them"


def test_a_search_that_ends_in_mid_pass_finds_the_whole_of_it_and_one_after_its_set_nothing() -> None:
    [whole] = find_passes(PROPAGATOR, SITE, LOW_TAI_S, LOW_TAI_S + 900.0, 5.0)
    middle = whole.rise_tai_s + 100.0
    [same] = find_passes(PROPAGATOR, SITE, LOW_TAI_S, middle, 5.0)
    assert (same.rise_tai_s, *same.hidden_tai_s[0], same.set_tai_s) == pytest.approx(
        (whole.rise_tai_s, *whole.hidden_tai_s[0], whole.set_tai_s), abs=2e-3
    )
    assert find_passes(PROPAGATOR, SITE, whole.set_tai_s + 1.0, whole.set_tai_s + 300.0, 5.0) == []


@pytest.fixture(scope="module")
def flight() -> Flight:
    begin_tai_s = hill()[0] - 30.0
    look = apparent_at(PROPAGATOR, np.array([begin_tai_s]), SITE)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    return flight_of(TARGET, begin_tai_s, hill()[1] - begin_tai_s + 15.0, antenna=antenna)


def hill() -> tuple[float, float]:
    return coming_pass(TARGET, LOW_TAI_S).hidden_tai_s[0]


@pytest.mark.long
def test_a_hill_in_mid_pass_is_no_loss_and_not_searched(flight: Flight) -> None:
    hides, shows = hill()
    assert shows - hides > 20.0
    assert flight.states()[-2:] == ["HOLD/FITTED", "AUTOTRACK/FITTED"]
    assert "SEARCH" not in flight.states()
    [gone] = [event for event in events_named(flight, "state.changed") if event["state"] == "HOLD/FITTED"]
    assert gone["cause"] == "the satellite is behind the mask"
    assert gone["back_in_s"] == pytest.approx(shows - hides, abs=2.0)
    assert state_at(flight, shows - 1.0) == "HOLD/FITTED"


def test_behind_the_hill_the_prediction_is_followed_and_it_is_told(flight: Flight) -> None:
    hides, shows = hill()
    assert worst_error_deg(flight, hides + 2.0, shows) < 0.25
    told = [seen for seen in flight.snapshots if hides + 2.5 < seen.tai_s < shows - 2.0]
    assert {seen.verdict for seen in told} == {"HIDDEN"}
    assert told[0].hidden_s == pytest.approx(shows - told[0].tai_s, abs=2.0)
    assert not any(row.is_acquired for row in rows_between(flight, hides + 2.5, shows - 2.0))


def test_the_signal_is_back_at_the_end_of_the_hill(flight: Flight) -> None:
    assert seconds_to_state(flight, "AUTOTRACK/FITTED", hill()[1] - 2.0) < 4.0


def test_the_schedule_counts_no_second_behind_a_hill_nor_in_a_keep_out_as_useful() -> None:
    coming, bounds = coming_pass(TARGET, LOW_TAI_S), TARGET.station.bounds
    whole = replace(bounds, skyline=None)
    [(hides, shows)] = coming.hidden_tai_s
    first, last = coming.rise_tai_s, coming.set_tai_s
    track = track_of("demo", PROPAGATOR, SITE, coming, SatelliteRules(), bounds)
    turn_deg = track.turns_deg(first, last, bounds.azimuth)[0]
    useful_s = track.useful_s(first, last, turn_deg, bounds.azimuth)
    assert useful_s == pytest.approx(last - first - (shows - hides), abs=8.0)
    mast = KeepOut("the mast", 270.0, 290.0)
    kept = sum(one.duration_s for one in kept_out(PROPAGATOR, SITE, (mast,), coming))
    track = track_of("demo", PROPAGATOR, SITE, coming, SatelliteRules(), replace(whole, keep_outs=(mast,)))
    assert kept > 20.0
    assert track.useful_s(first, last, turn_deg, bounds.azimuth) == pytest.approx(last - first - kept, abs=8.0)

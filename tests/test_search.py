"""SEARCH looks along the track first, then across, without a gap, and never into the horizon mask; it goes on later."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import cos, hypot, radians

import numpy as np
import pytest
from flights import (
    DEMO_ANTENNA,
    DEMO_TAI_S,
    RISING_ANTENNA,
    RISING_TAI_S,
    demo_target,
    events_named,
    fastest_followed_deg_s,
    flight_of,
    seconds_to_state,
)
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import Scan
from acu_daemon.control.tracking.scan import (
    boxes,
    covered_text,
    go_on,
    is_done,
    look,
    needed_s,
    pace_s_s,
    place,
    pointing,
)
from acu_daemon.control.tracking.track_frame import extents
from acu_daemon.model import AxisLimits, Model, Pointing, Prediction, Reading
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.sim.scenario import SkyErrors

CONFIG = ControlConfig(Envelope(AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
RATE_DEG_S = 0.5
PERIOD_S = 0.1
SEEN_BEAMS = 0.5
GRID_S, GRID_DEG = 0.5, 0.1


def straight_path(el_deg: float, el_rate_deg_s: float = 0.0, az_rate_deg_s: float = RATE_DEG_S) -> Prediction:
    """Level at an elevation, or rising."""
    t = np.arange(-400, 4000) * 0.1
    az_rate = np.full(t.size, az_rate_deg_s / cos(radians(el_deg)))
    el_rate = np.full(t.size, el_rate_deg_s)
    az, el = az_rate * t - 100.0, el_deg + el_rate * t
    return Prediction(-40.0, 0.1, az, el, az_rate, el_rate, az, az_rate, "TLE", 0.0)


PATH = straight_path(40.0)


def obedient(point: Pointing) -> tuple[float, float]:
    return point.az_deg, point.el_deg


def searched(
    prediction: Prediction,
    config: ControlConfig,
    until_s: float,
    scan: Scan | None = None,
    antenna: Callable[[Pointing], tuple[float, float]] = obedient,
) -> Iterator[tuple[float, Scan, Pointing]]:
    """Search with an antenna that is where it is told at once, or as `antenna` says."""
    scan = scan or Scan()
    for k in range(round(until_s / PERIOD_S)):
        t = k * PERIOD_S
        point = pointing(scan, prediction, t, config)
        assert point is not None
        az_deg, el_deg = antenna(point)
        yield t, scan, point
        scan = go_on(scan, prediction, Reading(t, az_deg % 360.0, el_deg, False), t, PERIOD_S, config)


@pytest.mark.long
@pytest.mark.parametrize("beamwidth_deg", [0.5, 1.0, 2.5])
def test_what_the_keys_say_is_covered_along_first_then_right_and_left_in_turn_without_a_gap(
    beamwidth_deg: float,
) -> None:
    config = replace(CONFIG, beamwidth_deg=beamwidth_deg)
    places, rows = [], []
    for _, scan, _ in searched(PATH, config, 600.0):
        if scan.round_count:
            break
        places.append(place(scan, config))
        if scan.is_aimed and scan.row not in rows:
            rows.append(scan.row)
    seen = np.array(places)
    for along_s in np.arange(-10.0, 10.01, GRID_S):
        across_deg = seen[:, 1] - np.arange(-2.0, 2.01, GRID_DEG)[:, None]
        off_deg = np.hypot((seen[:, 0] - along_s) * RATE_DEG_S, across_deg).min(axis=1)
        assert off_deg.max() < SEEN_BEAMS * beamwidth_deg
    assert rows == list(boxes(PATH, config)[1].rows())


def test_the_path_is_searched_to_both_ends_before_anything_beside_it_and_within_search_s() -> None:
    config = replace(CONFIG, beamwidth_deg=0.5)
    t, scan = next((t, scan) for t, scan, _ in searched(PATH, config, 600.0) if scan.row == 1)
    assert scan.covered[0][0] <= -9.95
    assert scan.covered[0][1] >= 9.95
    assert t < config.search_s


@given(st.floats(0.05, 3.0), st.floats(0.3, 3.0), st.floats(1.0, 20.0))
def test_no_row_is_searched_faster_than_the_beam_or_the_drives_allow(rate: float, beam: float, drive: float) -> None:
    config = replace(
        CONFIG,
        beamwidth_deg=beam,
        envelope=replace(CONFIG.envelope, azimuth=AxisLimits(-270.0, 270.0, drive, 10.0)),
    )
    path = straight_path(30.0, 0.0, rate)
    for side in (-1, 1):
        scan = Scan(side=side, is_aimed=True)
        pace = pace_s_s(scan, path, 10.0, config)
        assert pace * rate <= beam + 1e-6
        point = look(scan, path, 10.0, config, pace=side * pace)
        assert point is not None
        still = look(scan, path, 10.0, config)
        assert still is not None
        assert abs(point.az_rate_deg_s) <= max(0.8 * drive, abs(still.az_rate_deg_s)) + 1e-6


@pytest.mark.long
@pytest.mark.parametrize(("el_deg", "el_rate_deg_s"), [(5.3, 0.0), (5.5, 0.02), (88.9, 0.0)])
def test_the_search_never_looks_below_the_mask_nor_beyond_a_limit_and_counts_nothing_there(
    el_deg: float, el_rate_deg_s: float
) -> None:
    config = replace(CONFIG, envelope=replace(CONFIG.envelope, elevation=AxisLimits(0.0, 89.0, 5.0, 5.0)))
    path = straight_path(el_deg, el_rate_deg_s, 0.4 if el_deg < 80.0 else 0.05)
    seen = list(searched(path, config, 100.0))
    assert all(5.0 <= point.el_deg <= 89.0 for _, _, point in seen)
    last = seen[-1][1]
    assert last.rows
    for row, (early_s, late_s) in last.covered.items():
        for along_s in (early_s + 0.2, late_s - 0.2):
            point_there = look(Scan(row=row, along_s=along_s), path, 100.0, config)
            assert point_there is not None
            assert point_there.el_deg > 4.9
    assert not is_done(last, boxes(path, config))


def test_an_antenna_that_does_not_come_covers_nothing() -> None:
    aside = searched(PATH, CONFIG, 30.0, antenna=lambda point: (point.az_deg, point.el_deg - 1.0))
    assert {scan.rows for _, scan, _ in aside} == {()}


def test_an_antenna_that_stays_a_quarter_of_a_beam_aside_does_not_end_the_search() -> None:
    aside = searched(PATH, CONFIG, 90.0, antenna=lambda point: (point.az_deg, point.el_deg - 0.25))
    *_, (_, scan, _) = aside
    assert {0, 1, -1} <= set(scan.covered)


def test_each_row_and_side_has_the_whole_patience_for_the_antenna_to_come() -> None:
    """An antenna a quarter of a beam aside counts as there after 10 s: on each side of each row anew."""
    aside = searched(PATH, CONFIG, 120.0, antenna=lambda point: (point.az_deg, point.el_deg - 0.25))
    came_s: list[float] = []
    began_s, before, is_waiting = 0.0, (0, 0), False
    for t, scan, _ in aside:
        if scan.is_aimed and (scan.row, scan.side) != before:
            began_s, before, is_waiting = t, (scan.row, scan.side), True
        elif scan.is_moving and is_waiting:
            came_s.append(t - began_s)
            is_waiting = False
    assert len(came_s) >= 6
    assert all(10.0 <= waited_s < 10.3 for waited_s in came_s), came_s


def test_a_search_that_is_taken_up_again_goes_on_where_it_was() -> None:
    whole = [scan for _, scan, _ in searched(PATH, CONFIG, 30.0)]
    again = [scan for _, scan, _ in searched(PATH, CONFIG, 5.0, replace(whole[-1], is_aimed=False))]
    assert whole[-1].rows
    for before, after in zip(again, again[1:], strict=False):
        for row, (early_s, late_s) in before.covered.items():
            assert after.covered[row][0] <= early_s
            assert after.covered[row][1] >= late_s
    assert abs(again[1].along_s) > 1.0 or again[1].row != 0


def test_another_prediction_is_searched_anew() -> None:
    *_, (_, scan, _) = searched(PATH, CONFIG, 20.0)
    other = replace(PATH, model=Model.LAST_PASS)
    assert go_on(scan, other, Reading(20.0, 0.0, 40.0, False), 20.0, PERIOD_S, CONFIG).rows == ()


@pytest.mark.long
def test_the_covariance_widens_what_is_searched_after_what_the_keys_say() -> None:
    wide = replace(PATH, spread=(5.0, 1.2))
    keys, whole = boxes(wide, CONFIG)[-2:]
    assert extents(wide, CONFIG) == (15.0, pytest.approx(3.6))
    assert (keys.along_s, whole.along_s, keys.row_count, whole.row_count) == (10.0, 15.0, 3, 5)
    scans = [scan for _, scan, _ in searched(wide, CONFIG, 300.0)]
    beyond = next(scan for scan in scans if scan.covered.get(0, (0.0, 0.0))[1] > 11.0)
    assert set(keys.rows()) <= set(beyond.covered)
    assert scans[-1].round_count >= 1
    assert needed_s(Scan(), wide, 0.0, CONFIG)[0] < needed_s(Scan(), wide, 0.0, CONFIG)[1]


def test_what_a_good_fit_says_is_searched_before_the_rest_of_what_the_keys_say() -> None:
    sure = replace(PATH, spread=(0.5, 0.3))
    scans = [scan for _, scan, _ in searched(sure, CONFIG, 60.0)]
    far = next(k for k, scan in enumerate(scans) if abs(scan.along_s) > 2.0)
    assert set(scans[far].covered) == {0, 1, -1}
    for early_s, late_s in scans[far].covered.values():
        assert early_s < -1.4
        assert late_s > 1.4


def test_what_is_covered_is_told_in_seconds_and_degrees() -> None:
    rows = ((-1, (-10.0, 10.0)), (0, (-10.0, 10.0)), (1, (-10.0, 4.0)))
    text = covered_text(Scan(rows=rows), PATH, CONFIG)
    assert text == "-10.0 to +10.0 s of +-10 s along, -1.20 to +0.50 deg of +-2.0 deg across"


# Flights


def search_flight(late_s: float, raan_deg: float, for_s: float) -> Flight:
    target = demo_target(fallback={"acquire_s": 3.0}, receiver={"beamwidth_deg": 0.5})
    errors = SkyErrors(along_track_s=late_s, delta_raan_deg=raan_deg)
    return flight_of(target, RISING_TAI_S, for_s, antenna=RISING_ANTENNA, errors=errors)


@pytest.mark.long
@pytest.mark.parametrize(
    ("late_s", "raan_deg", "limit_s"), [(-8.0, 0.0, 20.0), (8.0, 0.0, 20.0), (0.0, 0.1, 40.0), (0.0, -0.1, 40.0)]
)
def test_a_beam_of_half_a_degree_finds_a_satellite_early_late_left_and_right(
    late_s: float, raan_deg: float, limit_s: float
) -> None:
    flight = search_flight(late_s, raan_deg, limit_s + 10.0)
    begun_s = seconds_to_state(flight, "SEARCH", RISING_TAI_S)
    assert seconds_to_state(flight, "AUTOTRACK/TLE", RISING_TAI_S) - begun_s < limit_s
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    (ended,) = events_named(flight, "search.ended")
    assert ended["is_found"]
    az_deg_s, el_deg_s = fastest_followed_deg_s(flight)
    assert az_deg_s <= 20.0
    assert el_deg_s <= 5.0


@pytest.mark.long
def test_eight_seconds_late_are_found_also_where_the_pass_is_fast() -> None:
    target = demo_target(fallback={"acquire_s": 3.0}, receiver={"beamwidth_deg": 0.5})
    flight = flight_of(target, DEMO_TAI_S, 46.0, antenna=DEMO_ANTENNA, errors=SkyErrors(along_track_s=8.0))
    assert seconds_to_state(flight, "AUTOTRACK/TLE", DEMO_TAI_S) < 45.0


@pytest.mark.long
def test_a_search_says_what_it_will_not_reach_and_the_next_one_goes_on() -> None:
    fallback = {"acquire_s": 3.0, "hold_s": 3.0, "search_s": 6.0}
    target = demo_target(fallback=fallback, receiver={"beamwidth_deg": 0.5})
    flight = flight_of(target, RISING_TAI_S, 50.0, antenna=RISING_ANTENNA, losses=[(0.0, 60.0)])
    begins, ended = events_named(flight, "search.begins"), events_named(flight, "search.ended")
    assert len(begins) >= 3
    assert all("not enough" in event["reason"] for event in begins)
    assert [event["covered"].split(" of")[0] for event in begins[1:]] == [
        event["covered"].split(" of")[0] for event in ended
    ][: len(begins) - 1]
    assert len({event["covered"] for event in ended}) >= 3
    shown = [seen.search for seen in flight.snapshots if seen.state == "SEARCH"]
    assert min(covered(text)[0] for text in shown if text) < -12.0


@pytest.mark.long
def test_a_search_of_a_minute_covers_all_that_the_keys_say_and_is_taken_up_in_mid_row() -> None:
    """The second search begins where the first one stopped, in the middle of a row beside the path."""
    target = demo_target(fallback={"hold_s": 5.0, "search_s": 20.0}, tracking={"estimator": "kalman"})
    flight = flight_of(target, RISING_TAI_S, 68.0, antenna=RISING_ANTENNA, losses=[(12.0, 70.0)])
    first, second = [covered(event["covered"]) for event in events_named(flight, "search.ended")][:2]
    assert min(-first[0], first[1]) > 9.9
    assert max(-first[2], first[3]) < 2.0
    assert min(-second[2], second[3]) > 1.8


def covered(text: str) -> tuple[float, ...]:
    """Seconds early and late, degrees left and right, of what a search tells."""
    return tuple(float(word) for part in text.split(", ")[:2] for word in part.split(" ")[0:3:2])


def test_a_place_is_as_far_off_the_path_as_its_seconds_and_degrees_say() -> None:
    point = look(Scan(row=1, along_s=4.0), PATH, 50.0, CONFIG)
    base = PATH.at(50.0)
    assert point is not None
    assert base is not None
    off_deg = hypot((point.az_deg - base.az_deg) * cos(radians(40.0)), point.el_deg - base.el_deg)
    assert off_deg == pytest.approx(hypot(4.0 * RATE_DEG_S, 0.7), rel=0.02)


def test_where_2_sigma_along_are_beyond_the_keys_the_three_rows_about_the_track_go_so_far_first() -> None:
    late = replace(PATH, spread=(6.2, 1.2))
    scans = [scan for _, scan, _ in searched(late, CONFIG, 200.0)]
    third = next(k for k, scan in enumerate(scans) if scan.row == 2)
    assert set(scans[third].covered) == {0, 1, -1}
    assert all(early_s < -12.3 and late_s > 12.3 for early_s, late_s in scans[third].covered.values())

"""Passes against a scan of every second, grazing thresholds included."""

from functools import cache

import numpy as np
import pytest
from conftest import DATA, needs_data

from acu_daemon.errors import OrbitError
from acu_daemon.model import Site, Station
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DAY_S

SPAN_S = 3 * DAY_S
GRAZE_DEG = 1e-4  # the threshold lies this little under the top of a pass
SITE = Site(Station("Cuiaba", -15.53, -56.07, 277.0))


def brouwer(a_km: float, e: float, i_deg: float, m_rad: float = 1.0) -> BrouwerPropagator:
    return BrouwerPropagator(BrouwerElements("test", 0.0, a_km * 1e3, e, float(np.radians(i_deg)), 1.0, 4.7, m_rad))


@cache
def real_sets() -> list[ElementSet]:
    files = sorted((DATA / "tle_sets").glob("*.txt"))
    return [one for path in files for one in parse_tle(path.read_text(), path.name)[0]]


def elevations_deg(propagator: Sgp4Propagator | BrouwerPropagator, site: Site, times: np.ndarray) -> np.ndarray:
    return look_at(propagator, times, site).el_deg


def check_against_scan(
    propagator: Sgp4Propagator | BrouwerPropagator, site: Site, times: np.ndarray, el_deg: np.ndarray, min_deg: float
) -> int:
    """Compare with the scan; the passes' number.  A pass between two seconds of the scan is allowed for."""
    passes = find_passes(propagator, site, float(times[0]), float(times[-1]), min_deg)
    is_covered = np.zeros(times.shape, dtype=bool)
    for one in passes:
        assert one.rise_tai_s <= one.culmination_tai_s <= one.set_tai_s
        is_covered |= (times >= one.rise_tai_s) & (times <= one.set_tai_s)
        inside = (times >= one.rise_tai_s) & (times <= one.set_tai_s)
        assert np.max(el_deg[inside], initial=min_deg) <= one.culmination_el_deg + 1e-9
    assert np.array_equal(is_covered, el_deg >= min_deg)
    return len(passes)


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("seed", range(16))
def test_no_pass_of_real_satellites_is_missed_in_three_days_grazing_ones_included(seed: int) -> None:
    rng = np.random.default_rng(seed)
    elements = real_sets()[int(rng.integers(len(real_sets())))]
    propagator = Sgp4Propagator(elements)
    site = Site(Station("any", float(np.degrees(np.arcsin(rng.uniform(-1, 1)))), float(rng.uniform(-180, 180)), 0.0))
    times = elements.epoch_tai_s + rng.uniform(0, DAY_S) + np.arange(0.0, SPAN_S)
    el_deg = elevations_deg(propagator, site, times)
    check_against_scan(propagator, site, times, el_deg, 5.0)
    tops = np.flatnonzero((el_deg[1:-1] > el_deg[:-2]) & (el_deg[1:-1] >= el_deg[2:])) + 1
    for top in rng.permutation(tops[el_deg[tops] > -5.0])[:3]:
        count = check_against_scan(propagator, site, times, el_deg, float(el_deg[top]) - GRAZE_DEG)
        assert count >= 1


@pytest.mark.long
@pytest.mark.parametrize("orbit", [(26600.0, 0.72, 63.4), (24400.0, 0.73, 7.0), (26560.0, 0.01, 55.0)])
def test_eccentric_and_high_orbits_are_found_too(orbit: tuple[float, float, float]) -> None:
    propagator = brouwer(*orbit)
    times = np.arange(0.0, SPAN_S)
    for latitude_deg in (-60.0, 5.0, 50.0):
        site = Site(Station("any", latitude_deg, 20.0, 0.0))
        el_deg = elevations_deg(propagator, site, times)
        assert check_against_scan(propagator, site, times, el_deg, 5.0) > 0


def test_rise_and_set_lie_on_the_threshold_within_a_millisecond() -> None:
    propagator = brouwer(7180, 0.001, 98.0)
    passes = find_passes(propagator, SITE, 0.0, DAY_S, 5.0)
    assert len(passes) >= 3
    for one in passes:
        edges = np.array([one.rise_tai_s - 1e-3, one.rise_tai_s, one.set_tai_s, one.set_tai_s + 1e-3])
        assert (elevations_deg(propagator, SITE, edges) >= 5.0).tolist() == [False, True, True, False]
        seen = look_at(propagator, np.array([one.rise_tai_s, one.culmination_tai_s, one.set_tai_s]), SITE)
        assert seen.az_deg.tolist() == [one.rise_az_deg, one.culmination_az_deg, one.set_az_deg]
        assert seen.el_deg[1] == one.culmination_el_deg
        assert one.duration_s == one.set_tai_s - one.rise_tai_s


def test_a_pass_cut_by_the_span_keeps_its_true_rise_and_set() -> None:
    propagator = brouwer(7180, 0.001, 98.0)
    whole = find_passes(propagator, SITE, 0.0, DAY_S, 5.0)[1]
    for start, end in [(0.3, 2.0), (0.8, 2.0), (-1.0, 0.4), (0.4, 0.6), (0.5, 0.5)]:
        cut = [whole.rise_tai_s + share * whole.duration_s for share in (start, end)]
        [same] = find_passes(propagator, SITE, cut[0], cut[1], 5.0)
        assert same.rise_tai_s == pytest.approx(whole.rise_tai_s, abs=1e-3)
        assert same.set_tai_s == pytest.approx(whole.set_tai_s, abs=1e-3)
        assert same.culmination_el_deg == pytest.approx(whole.culmination_el_deg, abs=1e-9)


def test_a_pass_before_or_after_the_span_is_not_given() -> None:
    propagator = brouwer(7180, 0.001, 98.0)
    whole = find_passes(propagator, SITE, 0.0, DAY_S, 5.0)[1]
    assert find_passes(propagator, SITE, whole.set_tai_s + 1.0, whole.set_tai_s + 600.0, 5.0) == []
    assert find_passes(propagator, SITE, whole.rise_tai_s - 600.0, whole.rise_tai_s - 1.0, 5.0) == []


def test_a_satellite_that_never_rises_has_no_pass() -> None:
    assert find_passes(brouwer(7000, 0.0, 5.0), Site(Station("north", 80.0, 0.0, 0.0)), 0.0, SPAN_S, 5.0) == []


def test_a_satellite_that_never_sets_has_one_pass_bounded_by_the_span() -> None:
    propagator = brouwer(42164.2, 0.0, 0.0)  # drifts by a degree or so
    for longitude_deg in range(0, 360, 30):
        site = Site(Station("below", 0.0, longitude_deg - 180.0, 0.0))
        el_deg = elevations_deg(propagator, site, np.zeros(1))[0]
        if abs(el_deg - 5.0) < 5.0:
            continue
        passes = find_passes(propagator, site, 0.0, SPAN_S, 5.0)
        spans = [(one.rise_tai_s, one.set_tai_s) for one in passes]
        assert spans == ([(0.0, SPAN_S)] if el_deg > 5.0 else [])


def test_the_same_question_has_the_same_answer_bit_for_bit() -> None:
    propagator = brouwer(7500, 0.01, 66.0)
    assert find_passes(propagator, SITE, 0.0, SPAN_S, 3.0) == find_passes(propagator, SITE, 0.0, SPAN_S, 3.0)


def test_the_passes_of_a_decaying_satellite_end_with_it() -> None:
    # decays 7 hours after its epoch (Vallado et al., AIAA 2006-6753)
    text = """1 29141U 85108AA  06170.26783845  .99999999  00000-0  13519-0 0   718
2 29141  82.4288 273.4882 0015848 277.2124  83.9133 15.93343074  6828
"""
    [one], [] = parse_tle(text, "deb.tle")
    propagator = Sgp4Propagator(one)
    north = Site(Station("north", 80.0, 0.0, 0.0))
    known_s = 7.0 * 3600.0
    during = find_passes(propagator, north, one.epoch_tai_s, one.epoch_tai_s + known_s, 0.0)
    assert len(during) >= 3
    assert find_passes(propagator, north, one.epoch_tai_s, one.epoch_tai_s + 30 * DAY_S, 0.0)[: len(during)] == during
    assert find_passes(propagator, north, one.epoch_tai_s + DAY_S, one.epoch_tai_s + 30 * DAY_S, 0.0) == []
    with pytest.raises(OrbitError, match="has decayed"):
        look_at(propagator, np.array([one.epoch_tai_s + DAY_S]), north)

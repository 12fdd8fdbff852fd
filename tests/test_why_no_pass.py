"""Why a satellite has no pass: latitude and inclination on either hemisphere, and satellites that hardly move."""

from dataclasses import replace
from math import acos, cos, degrees, pi, radians
from typing import Any

import numpy as np
import pytest

from acu_daemon.model import Site, Station
from acu_daemon.orbit.kepler import OsculatingElements, state_from_elements
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.visibility import SLOW_S, SPARE_DEG, why_none
from acu_daemon.pointing.skyline import skyline_of
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

START = 8.4e8
LOW_M = 7.0e6


class Ellipse:
    """A satellite on an ellipse that nothing disturbs."""

    kind, epoch_tai_s = "ellipse", START

    def __init__(self, a_m: float, i_deg: float, e: float = 0.0, raan_deg: float = 0.0) -> None:
        self.a_m, self.i_rad, self.e, self.raan_rad = a_m, radians(i_deg), e, radians(raan_deg)

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        one = np.ones_like(tai_s)
        turned = (MU_M3_S2 / self.a_m**3) ** 0.5 * (tai_s - START)
        return state_from_elements(
            OsculatingElements(self.a_m * one, self.e * one, self.i_rad * one, self.raan_rad * one, 0.0 * one, turned)
        )


def at(latitude_deg: float, longitude_deg: float = 10.0) -> Site:
    return Site(Station("there", latitude_deg, longitude_deg, 0.0))


def said(satellite: Ellipse, site: Site, days: float = 1.0, low_deg: float = 5.0) -> str:
    source: Any = satellite
    return why_none(source, site, START, START + days * DAY_S, low_deg)


def reach_deg(farthest_m: float, low_deg: float) -> float:
    """How far from the point below it a satellite is seen above an elevation, over a round Earth."""
    return degrees(acos(EARTH_EQUATORIAL_RADIUS_M * cos(radians(low_deg)) / farthest_m)) - low_deg


@pytest.mark.parametrize("latitude_deg", [60.0, -60.0])
@pytest.mark.parametrize("i_deg", [30.0, 150.0])
def test_an_orbit_that_stays_near_the_equator_never_rises_far_from_it(i_deg: float, latitude_deg: float) -> None:
    assert said(Ellipse(LOW_M, i_deg), at(latitude_deg)) == (
        f"it never rises above 5 deg here: with an inclination of {i_deg:.1f} deg it does so up to latitude "
        f"{30.0 + reach_deg(LOW_M, 5.0):.0f} only, the station's is 60.0"
    )


@pytest.mark.parametrize("i_deg", [30.0, 90.0, 150.0])
@pytest.mark.parametrize("latitude_deg", [40.0, -40.0])
def test_a_low_satellite_that_may_rise_is_explained_by_chance_alone(i_deg: float, latitude_deg: float) -> None:
    assert said(Ellipse(LOW_M, i_deg), at(latitude_deg)) == ""


@pytest.mark.parametrize("low_deg", [0.0, 5.0, 20.0])
@pytest.mark.parametrize("i_deg", [30.0, 150.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("e", [0.0, 0.05])
def test_half_a_degree_beyond_the_reach_from_apogee_is_spared(
    e: float, sign: float, i_deg: float, low_deg: float
) -> None:
    limit_deg = 30.0 + reach_deg(LOW_M * (1.0 + e), low_deg) + 0.5
    assert SPARE_DEG == 0.5
    satellite = Ellipse(LOW_M, i_deg, e)
    assert said(satellite, at(sign * (limit_deg - 0.01)), low_deg=low_deg) == ""
    text = said(satellite, at(sign * (limit_deg + 0.01)), low_deg=low_deg)
    assert text.startswith(f"it never rises above {low_deg:g} deg here")


def test_an_orbit_below_the_ground_reaches_nothing() -> None:
    fallen = Ellipse(6.3e6, 30.0)
    assert said(fallen, at(30.4)) == ""
    assert "up to latitude 30 only, the station's is 30.6" in said(fallen, at(30.6))


@pytest.mark.parametrize(("share", "is_slow"), [(0.999, False), (1.001, True), (1.2, True)])
def test_a_revolution_of_twenty_hours_is_slow(share: float, is_slow: bool) -> None:
    assert SLOW_S == 72_000.0
    a_m = (MU_M3_S2 * (share * SLOW_S / (2.0 * pi)) ** 2) ** (1.0 / 3.0)
    assert bool(said(Ellipse(a_m, 0.0), at(10.0), days=0.05)) == is_slow


@pytest.mark.parametrize("latitude_deg", [10.0, -10.0])
@pytest.mark.parametrize("raan_deg", [0.0, 120.0, 240.0])
@pytest.mark.parametrize("span_s", [7500.0, 1.5 * DAY_S])
def test_of_a_slow_satellite_its_highest_place_in_the_span_is_told_both_ends_included(
    span_s: float, raan_deg: float, latitude_deg: float
) -> None:
    a_m = (MU_M3_S2 * (30.0 * 3600.0 / (2.0 * pi)) ** 2) ** (1.0 / 3.0)
    satellite: Any = Ellipse(a_m, 0.0, raan_deg=raan_deg)
    seen = look_at(satellite, np.append(np.arange(START, START + span_s, 600.0), START + span_s), at(latitude_deg))
    top = int(np.argmax(seen.el_deg))
    assert said(satellite, at(latitude_deg), days=span_s / DAY_S, low_deg=7.5) == (
        f"it does not rise above 7.5 deg within {span_s / DAY_S:g} days: it stays at {seen.el_deg[top]:.1f} deg "
        f"elevation or lower, azimuth {seen.az_deg[top]:.1f}"
    )


def test_the_highest_place_may_be_the_very_end_of_the_span() -> None:
    texts = []
    for span_s in (601.0, 1199.0):
        a_m = (MU_M3_S2 * (21.0 * 3600.0 / (2.0 * pi)) ** 2) ** (1.0 / 3.0)
        satellite: Any = Ellipse(a_m, 0.0)
        ends = look_at(satellite, np.array([START, START + span_s]), at(10.0, rising_longitude_deg(satellite)))
        assert ends.el_deg[1] > ends.el_deg[0]
        texts.append(said(satellite, at(10.0, rising_longitude_deg(satellite)), days=span_s / DAY_S))
        assert f"it stays at {ends.el_deg[1]:.1f} deg" in texts[-1]
    assert texts[0].split("it stays")[1] != texts[1].split("it stays")[1]


def rising_longitude_deg(satellite: Any) -> float:
    """Where it stands in the west at the start and comes nearer."""
    tried = np.arange(-180.0, 180.0, 10.0).tolist()
    rise = [np.diff(look_at(satellite, np.array([START, START + 900.0]), at(10.0, one)).el_deg)[0] for one in tried]
    return float(tried[int(np.argmax(rise))])


def test_behind_a_mask_the_orbit_itself_may_still_be_the_reason() -> None:
    walled = replace(at(60.0), skyline=skyline_of(((0.0, 60.0),)))
    assert said(Ellipse(LOW_M, 30.0), walled).startswith("it never rises above 5 deg here")
    walled = replace(at(20.0), skyline=skyline_of(((0.0, 89.9),)))
    text = said(Ellipse(LOW_M, 30.0), walled)
    assert text.startswith("all of its passes above 5 deg are behind the mask, ")
    fewer = said(Ellipse(LOW_M, 30.0), walled, low_deg=40.0)
    assert fewer.startswith("all of its passes above 40 deg are behind the mask, ")
    assert int(fewer.split()[-3]) < int(text.split()[-3])

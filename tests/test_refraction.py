"""Air and refraction: against P.453, P.835, an independent integrator and ERFA; both ways, smooth, bounded."""

import erfa
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refraction_figures import (
    ELEVATIONS_DEG,
    HEIGHTS_M,
    asked_deg,
    integrated_geometric_el_deg,
    p834_deg,
    range_on_ray_m,
)

from acu_daemon.model import Station
from acu_daemon.pointing.air import Air, refractivity, saturation_hpa, standard_air
from acu_daemon.pointing.refraction import MOST_N, SCALE_HEIGHT_M, curvature_radius_m, traced

SEA = Station("sea", 45.0, 0.0, 0.0)
AIR_N = 323.0
BOTH_WAYS_DEG = 1e-7  # the rest of Newton's solution, at worst below the horizon in the densest air
P834_DEG = 0.010  # of the formula, from P.834's own atmosphere
ERFA_DEG = 5e-4
RANGES_M = st.floats(4e5, 4e6) | st.just(np.inf)
REFRACTION = traced(AIR_N, SEA)


@pytest.mark.parametrize("height_m", HEIGHTS_M)
@pytest.mark.parametrize("el_deg", ELEVATIONS_DEG)
def test_the_refraction_is_that_of_rays_integrated_another_way(el_deg: float, height_m: float) -> None:
    station = Station("there", 45.0, 0.0, height_m)
    radius_m = curvature_radius_m(station)
    surface_n = refractivity(standard_air(station))
    range_m = range_on_ray_m(el_deg, height_m, radius_m)
    integrated = integrated_geometric_el_deg(
        el_deg, range_m, lambda up_m: surface_n * np.exp(-up_m / SCALE_HEIGHT_M), radius_m
    )
    refraction = traced(surface_n, station)
    assert float(refraction.geometric_el_deg(el_deg, range_m)) == pytest.approx(integrated, abs=asked_deg(el_deg) / 50)
    assert float(refraction.apparent_el_deg(integrated, range_m)) == pytest.approx(el_deg, abs=asked_deg(el_deg) / 50)


def test_p834s_formula_is_met_as_closely_as_it_promises() -> None:
    refraction = traced(315.0, SEA)
    for el_deg in (0.0, 1.0, 2.0, 5.0, 10.0):
        ours = el_deg - float(refraction.geometric_el_deg(el_deg, np.inf))
        assert ours == pytest.approx(p834_deg(el_deg, 0.0), abs=P834_DEG)


@pytest.mark.parametrize("air", [Air(1013.25, 15.0, 0.0), Air(900.0, 25.0, 70.0), Air(1030.0, -20.0, 50.0)])
def test_above_10_deg_it_is_erfas_radio_refraction(air: Air) -> None:
    refraction = traced(refractivity(air), SEA)
    a, b = erfa.refco(air.pressure_hpa, air.temperature_c, air.humidity_percent / 100.0, 1e5)
    for el_deg in (15.0, 30.0, 60.0, 89.0):
        tangent = 1.0 / np.tan(np.radians(el_deg))
        theirs = float(np.degrees(a * tangent + b * tangent**3))
        assert el_deg - float(refraction.geometric_el_deg(el_deg, np.inf)) == pytest.approx(theirs, abs=ERFA_DEG)


def test_the_refractivity_is_that_of_p453() -> None:
    # by hand: 77.6 P / T less 5.6 e / T and 3.75e5 e / T^2; water at 20 deg C holds 23.37 hPa (CRC)
    assert refractivity(Air(1013.25, 15.0, 0.0)) == pytest.approx(77.6 * 1013.25 / 288.15, abs=1e-9)
    assert saturation_hpa(Air(1013.25, 20.0, 0.0)) == pytest.approx(23.37, rel=0.006)  # moist air holds 0.4 % more
    assert refractivity(Air(1000.0, 20.0, 100 * 14.0 / saturation_hpa(Air(1000.0, 20.0, 0.0)))) == pytest.approx(
        264.71 - 0.27 + 61.09, abs=0.02
    )


def test_the_standard_air_has_no_steps_in_latitude_and_thins_with_height() -> None:
    latitudes = np.arange(-90.0, 90.5, 0.5)
    n = [refractivity(standard_air(Station("s", float(latitude), 0.0, 0.0))) for latitude in latitudes]
    assert max(abs(np.diff(n))) < 2.0
    assert n == n[::-1]  # south as north
    assert min(n) > 300.0 and max(n) < 390.0  # P.453's maps of the year's mean at sea level
    high = standard_air(Station("s", 0.0, 0.0, 3000.0))
    assert refractivity(high) < 0.65 * refractivity(standard_air(Station("s", 0.0, 0.0, 0.0)))
    assert high.pressure_hpa == pytest.approx(717.6, abs=0.1)  # P.835, low latitudes


def test_more_refractivity_than_weather_can_have_is_refused() -> None:
    with pytest.raises(ValueError, match=r"surface refractivity of 600: expected 0 to 450"):
        traced(600.0, SEA)


def test_without_air_nothing_is_refracted() -> None:
    el_deg = np.linspace(-5.0, 185.0, 50)
    assert traced(0.0, SEA).apparent_el_deg(el_deg, 1e6) == pytest.approx(el_deg, abs=1e-12)


@given(st.floats(-90.0, 270.0), RANGES_M, st.floats(0.0, MOST_N), st.floats(0.5, 1.5), st.floats(0.0, 4000.0))
def test_there_and_back_is_the_same_elevation(
    el_deg: float, range_m: float, surface_n: float, scale: float, height_m: float
) -> None:
    refraction = traced(surface_n, Station("s", 30.0, 0.0, height_m))
    apparent = refraction.apparent_el_deg(el_deg, range_m, scale)
    assert float(refraction.geometric_el_deg(apparent, range_m, scale)) == pytest.approx(el_deg, abs=BOTH_WAYS_DEG)


@pytest.mark.long
@settings(max_examples=20)
@given(st.floats(1e6, 4e6) | st.just(np.inf), st.floats(100.0, MOST_N))  # at the horizon no satellite is nearer
def test_from_below_the_horizon_over_the_zenith_it_rises_without_a_step(range_m: float, surface_n: float) -> None:
    el_deg = np.linspace(-3.0, 183.0, 18601)
    apparent = traced(surface_n, SEA).apparent_el_deg(el_deg, range_m)
    assert np.diff(apparent).min() > 0.0
    assert np.abs(np.diff(apparent, 2)).max() < 3e-4
    assert apparent + apparent[::-1] == pytest.approx(180.0, abs=1e-7)


@given(st.floats(-3.0, 183.0), RANGES_M, st.floats(0.8, 1.2))
def test_the_derivatives_are_those_of_differences(el_deg: float, range_m: float, scale: float) -> None:
    h = 1e-4
    apparent, by_el, by_scale = REFRACTION.apparent_with_slope(el_deg, range_m, scale)
    up, down = (REFRACTION.apparent_el_deg(el_deg + d, range_m, scale) for d in (h, -h))
    more, less = (REFRACTION.apparent_el_deg(el_deg, range_m, scale + d) for d in (h, -h))
    assert float(by_el) == pytest.approx(float(up - down) / (2 * h), abs=1e-4)
    assert float(by_scale) == pytest.approx(float(more - less) / (2 * h), abs=1e-4)
    assert float(apparent) == pytest.approx(float(up + down) / 2, abs=1e-6)


def test_scalars_and_arrays_are_the_same() -> None:
    el_deg, range_m = np.linspace(-2.0, 90.0, 7), np.linspace(3e6, 8e5, 7)
    together = REFRACTION.apparent_el_deg(el_deg, range_m)
    alone = [float(REFRACTION.apparent_el_deg(e, r)) for e, r in zip(el_deg, range_m, strict=True)]
    assert together == pytest.approx(alone, abs=1e-8)
    assert REFRACTION.apparent_el_deg(10.0, 1e6).shape == ()

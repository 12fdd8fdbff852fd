"""What the sky does to an unsteered orbit: flux by the day, drag by geometry in space, and the integrals over time."""

from dataclasses import replace

import numpy as np
import pytest

from acu_daemon.groundtrack.atmosphere import Activity, density_table, exospheric_k, semi_annual
from acu_daemon.groundtrack.environment import (
    EPOCH_TAI_S,
    Flux,
    Spacecraft,
    decay_m_s,
    effective_flux,
    even_steps,
    free_motion,
    node_rad,
    running_integral,
)
from acu_daemon.groundtrack.lunisolar import plane_rates, sun
from acu_daemon.groundtrack.reference import CBERS_CYCLE, about, sun_synchronous
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, EARTH_FLATTENING, MU_M3_S2

CRAFT = Spacecraft()
JUNE, DECEMBER = (tai_from_utc(f"2010-{month}-21T00:00:00Z") for month in ("06", "12"))


def test_values_hold_at_the_middle_of_their_day_and_linearly_between() -> None:
    flux = Flux(1000.0, np.array([100.0, 140.0, 120.0]), np.array([1.0, 3.0, 5.0]))
    days = np.array([-1.0, 0.0, 0.5, 1.0, 1.5, 1.75, 2.5, 3.0, 9.0])
    seen = flux.at(1000.0 + days * DAY_S)
    assert seen.f107 == pytest.approx([100.0, 100.0, 100.0, 120.0, 140.0, 135.0, 120.0, 120.0, 120.0])
    assert seen.kp == pytest.approx([1.0, 1.0, 1.0, 2.0, 3.0, 3.5, 5.0, 5.0, 5.0])
    assert flux.end_tai_s == 1000.0 + 3.0 * DAY_S


@pytest.mark.parametrize("day", [0, 1, 39, 40, 41, 100, 159, 160, 199])
def test_the_mean_is_over_forty_days_on_either_side_and_fewer_at_the_ends(day: int) -> None:
    f107 = 70.0 + 0.01 * np.arange(200.0) ** 2
    seen = Flux(0.0, f107, np.zeros(200)).at(np.array([(day + 0.5) * DAY_S]))
    assert seen.f107_mean[0] == pytest.approx(np.mean(f107[max(0, day - 40) : day + 41]))
    assert seen.f107[0] == pytest.approx(f107[day])


def test_the_effective_flux_heats_as_the_two_do() -> None:
    mean, day = np.array([100.0, 100.0, 150.0]), np.array([100.0, 181.0, 69.0])
    effective = effective_flux(Activity(day, mean, np.zeros(3)))
    hour, zero = np.full(3, 1.0), np.zeros(3)
    two = exospheric_k(Activity(day, mean, zero), hour, zero, zero)
    one = exospheric_k(Activity(effective, effective, zero), hour, zero, zero)
    assert one == pytest.approx(two, rel=1e-12)
    assert effective[1] == pytest.approx(132.5)


def drag_in_space(craft: Spacecraft, tai_s: float, activity: Activity, year_fraction: float | None = None) -> float:
    """da/dt from vectors: where the satellite is, seen from the Earth's centre, and where the Sun is."""
    orbit = craft.reference
    to_sun = sun(np.array([tai_s])).direction[0]
    node = np.arctan2(to_sun[1], to_sun[0]) + np.radians(15.0 * (craft.node_hour - 12.0))
    densities = []
    for u in np.radians(np.arange(0.0, 360.0, 15.0)):
        ahead = np.array([np.cos(node), np.sin(node), 0.0])
        across = np.array(
            [-np.sin(node) * np.cos(orbit.i_rad), np.cos(node) * np.cos(orbit.i_rad), np.sin(orbit.i_rad)]
        )
        to = np.cos(u) * ahead + np.sin(u) * across
        perigee = across  # over the north
        radius_m = orbit.a_m * (1.0 - orbit.e * float(to @ perigee))
        latitude = np.arcsin(to[2])
        hour = np.arctan2(to[1], to[0]) - np.arctan2(to_sun[1], to_sun[0])
        ground_m = EARTH_EQUATORIAL_RADIUS_M * (1.0 - EARTH_FLATTENING * to[2] ** 2)
        height_km = np.array([(radius_m - ground_m) / 1000.0])
        hot = exospheric_k(activity, np.array([hour]), np.array([latitude]), np.arcsin(to_sun[2:]))
        power = density_table().log10_at(hot, height_km)
        if year_fraction is not None:
            power = power + semi_annual(height_km, np.array([year_fraction]))
        densities.append(10.0 ** power[0])
    speed = np.sqrt(MU_M3_S2 / orbit.a_m)
    turn = 2.0 * np.pi / DAY_S * orbit.a_m / speed  # of the air, over the satellite's speed
    air = (1.0 - turn * np.cos(orbit.i_rad)) ** 2
    return float(-craft.ballistic_m2_kg * np.mean(densities) * speed * orbit.a_m * air)


def activity(f107: float, mean: float, kp: float) -> Activity:
    return Activity(*(np.array([one]) for one in (f107, mean, kp)))


@pytest.mark.parametrize("i_deg", [50.0, 98.5, 140.0])
@pytest.mark.parametrize("node_hour", [22.5, 14.0, 6.0])
@pytest.mark.parametrize("tai_s", [JUNE, DECEMBER])
def test_drag_is_that_of_the_vectors_in_space(tai_s: float, node_hour: float, i_deg: float) -> None:
    orbit = about(CBERS_CYCLE, 7.0e6, 0.03, np.radians(i_deg))
    craft = Spacecraft(orbit, 0.03, node_hour)
    now = activity(150.0, 130.0, 3.0)
    assert decay_m_s(craft, np.array([tai_s]), now)[0] == pytest.approx(drag_in_space(craft, tai_s, now), rel=2e-3)


def test_the_semi_annual_variation_counts_from_the_new_year_where_it_is_asked_for() -> None:
    times = EPOCH_TAI_S + np.array([0.0, 100.0, 200.0, 300.0]) * DAY_S
    now = Activity(*(np.full(4, one) for one in (150.0, 130.0, 3.0)))
    with_it, without = (decay_m_s(CRAFT, times, now, has_semi_annual=has) for has in (True, False))
    for k, tai_s in enumerate(times.tolist()):
        one = activity(150.0, 130.0, 3.0)
        year = k * 100.0 / 365.2422
        assert with_it[k] == pytest.approx(drag_in_space(CRAFT, tai_s, one, year), rel=2e-3)
        assert without[k] == pytest.approx(drag_in_space(CRAFT, tai_s, one), rel=2e-3)
    assert decay_m_s(CRAFT, times, now) == pytest.approx(without)
    assert np.abs(with_it / without - 1.0).max() > 0.05


def test_twice_the_area_is_twice_the_drag_and_it_lowers_the_orbit() -> None:
    one = decay_m_s(CRAFT, np.array([JUNE]), activity(100.0, 100.0, 2.0))
    twice = decay_m_s(
        replace(CRAFT, ballistic_m2_kg=2.0 * CRAFT.ballistic_m2_kg), np.array([JUNE]), activity(100.0, 100.0, 2.0)
    )
    assert one[0] < 0.0
    assert twice == pytest.approx(2.0 * one)


STEADY = Flux(EPOCH_TAI_S - 30.0 * DAY_S, np.full(100, 150.0), np.full(100, 3.0))


def test_without_air_sun_and_moon_nothing_moves() -> None:
    free = free_motion(CRAFT, 3.0, None, has_lunisolar=False)
    for one in (free.a_m, free.i_rad, free.raan_rad, free.alpha_rad, free.d_m, free.drag_m_s2, free.lunisolar_m_s2):
        assert one.tolist() == [0.0] * (3 * 480 + 1)
    assert (free.start_tai_s, free.step_s, free.times_s[0], free.times_s[-1]) == (EPOCH_TAI_S, 180.0, 0.0, 3.0 * DAY_S)
    assert np.diff(free.times_s) == pytest.approx(np.full(1440, 180.0))


def test_drag_alone_lowers_the_axis_evenly_and_bends_d_eastwards() -> None:
    free = free_motion(CRAFT, 2.0, STEADY, has_lunisolar=False)
    reference, t = CRAFT.reference, free.times_s
    rate = decay_m_s(
        CRAFT,
        EPOCH_TAI_S + np.arange(0.0, 2.0 * DAY_S + 1.0, 3600.0),
        Activity(*(np.full(49, one) for one in (150.0, 150.0, 3.0))),
    )
    assert free.a_m == pytest.approx(np.mean(rate) * t, rel=2e-3, abs=1e-3)
    assert free.i_rad.tolist() == [0.0] * t.size
    assert free.raan_rad[-1] == pytest.approx(reference.by_a.raan * np.mean(rate) * t[-1] ** 2 / 2.0, rel=3e-3)
    assert free.alpha_rad[-1] == pytest.approx(reference.by_a.alpha * np.mean(rate) * t[-1] ** 2 / 2.0, rel=3e-3)
    assert free.d_m[-1] == pytest.approx(reference.drift_m(free.raan_rad, free.alpha_rad)[-1])
    assert free.d_m[-1] > 0.0
    assert free.drag_m_s2 == pytest.approx(reference.by_a.drift * np.interp(t, np.arange(49) * 3600.0, rate))
    assert free.lunisolar_m_s2.tolist() == [0.0] * t.size


def test_sun_and_moon_alone_leave_the_axis_and_move_the_plane_as_their_rates_have_it() -> None:
    free = free_motion(CRAFT, 4.0, None, start_tai_s=JUNE, step_s=3600.0)
    reference, t = CRAFT.reference, free.times_s
    node = node_rad(CRAFT, JUNE) + reference.raan_rate_rad_s * t
    rates = plane_rates(JUNE + t, reference.a_m, reference.i_rad, node)
    assert free.a_m.tolist() == [0.0] * t.size
    tilt = running_integral(rates.inclination, 3600.0)
    assert free.i_rad == pytest.approx(tilt, rel=1e-9, abs=1e-15)
    raan = running_integral(rates.raan + reference.by_i.raan * tilt, 3600.0)
    alpha = running_integral(rates.alpha + reference.by_i.alpha * tilt, 3600.0)
    assert free.raan_rad == pytest.approx(raan, rel=1e-9, abs=1e-15)
    assert free.alpha_rad == pytest.approx(alpha, rel=1e-9, abs=1e-15)
    assert np.abs(tilt[-1]) > 1e-6


@pytest.mark.parametrize("flux", [None, STEADY])
def test_the_two_accelerations_together_are_that_of_d(flux: Flux | None) -> None:
    free = free_motion(CRAFT, 6.0, flux, step_s=1800.0)
    bent = np.gradient(np.gradient(free.d_m, 1800.0), 1800.0)
    ours = free.drag_m_s2 + free.lunisolar_m_s2
    assert np.max(np.abs(bent - ours)[4:-4]) < 0.03 * np.max(np.abs(free.lunisolar_m_s2))


def test_the_drag_comes_from_the_flux_of_the_time_and_the_semi_annual_variation_when_asked() -> None:
    rising = Flux(JUNE, 80.0 + 2.0 * np.arange(40.0), np.full(40, 2.0))
    early, late = (free_motion(CRAFT, 1.0, rising, start_tai_s=JUNE + d * DAY_S, has_lunisolar=False) for d in (5, 30))
    assert late.a_m[-1] < 1.5 * early.a_m[-1] < 0.0
    varied = free_motion(CRAFT, 1.0, rising, start_tai_s=JUNE + 5 * DAY_S, has_lunisolar=False, has_semi_annual=True)
    assert abs(varied.a_m[-1] / early.a_m[-1] - 1.0) > 0.05


def test_the_density_factor_holds_at_its_days_from_the_start_and_linearly_between() -> None:
    plain = free_motion(CRAFT, 3.0, STEADY, has_lunisolar=False)
    factor = np.array([1.0, 3.0, 2.0])
    thick = free_motion(CRAFT, 3.0, STEADY, has_lunisolar=False, density_factor=factor)
    expected = plain.drag_m_s2 * np.interp(plain.times_s / DAY_S, np.arange(3.0), factor)
    assert thick.drag_m_s2 == pytest.approx(expected, rel=1e-3)
    assert free_motion(CRAFT, 1.0, None, has_lunisolar=False, density_factor=factor).a_m.tolist() == [0.0] * 481


@pytest.mark.parametrize("hour", [0.0, 6.0, 12.0, 18.0, 22.5])
def test_the_node_stands_as_many_hours_east_of_the_sun_as_its_local_time_is_after_noon(hour: float) -> None:
    x, y, _ = sun(np.array([JUNE])).direction[0]
    node = node_rad(replace(CRAFT, node_hour=hour), JUNE)
    turned = np.degrees(node) - np.degrees(np.arctan2(y, x))
    assert turned == pytest.approx(15.0 * (hour - 12.0), abs=1e-9)


def test_integrals_go_by_trapezoids_from_zero() -> None:
    assert running_integral(np.array([2.0, 4.0, 10.0]), 3.0).tolist() == [0.0, 9.0, 30.0]
    assert even_steps(5.0, 2.5, 3).tolist() == [5.0, 7.5, 10.0]
    assert even_steps(5.0, 2.5, 0).tolist() == []


def test_the_craft_is_cbers_unless_another_is_named() -> None:
    assert CRAFT.reference == sun_synchronous(CBERS_CYCLE)
    assert (CRAFT.ballistic_m2_kg, CRAFT.node_hour) == (0.0682, 22.5)

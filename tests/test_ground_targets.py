"""Targets on the ground around the station: where they lie, how far, and the rates they ask of the azimuth."""

from functools import lru_cache

import numpy as np
import pytest

from acu_daemon.model import Station
from acu_daemon.onboard.targets import GUARD_DEG, THREE_BEARINGS_DEG, peak_rates_deg_s, search_grid, three_stations
from acu_daemon.onboard.view import PassView, ground_points_itrs_m, off_pointing_deg
from acu_daemon.orbit.frames import station_itrs_m
from acu_daemon.units import Array

NORTH, SOUTH = Station("north", 36.0, 127.0, 200.0), Station("south", -36.0, -57.0, 200.0)


@lru_cache
def flight(station: Station, height_m: float = 685e3, side_deg: float = 1.0, count: int = 4001) -> PassView:
    """A satellite that flies northwards past a station, 7.5 km/s; the gimbal's axis looks down, its x ahead."""
    up = station_itrs_m(station) / np.linalg.norm(station_itrs_m(station))
    east = np.cross([0.0, 0.0, 1.0], up)
    east /= np.linalg.norm(east)
    north = np.cross(up, east)
    beside = np.cos(np.radians(side_deg)) * up + np.sin(np.radians(side_deg)) * east
    radius_m = 6.37e6 + height_m
    tai_s = 0.05 * np.arange(count)
    turn = 7500.0 / radius_m * (tai_s - tai_s[-1] / 2.0)[:, None]
    away, forward = np.cos(turn) * beside + np.sin(turn) * north, np.cos(turn) * north - np.sin(turn) * beside
    across = np.cross(-away, forward)
    return PassView(tai_s, radius_m * away, np.stack([forward, across, -away], axis=1))


def east_north_m(station: Station, points: Array) -> tuple[Array, Array]:
    here = station_itrs_m(station)
    east = np.cross([0.0, 0.0, 1.0], here)
    east /= np.linalg.norm(east)
    north = np.cross(here, east) / np.linalg.norm(here)
    return (points - here) @ east, (points - here) @ north


@pytest.mark.parametrize("station", [NORTH, SOUTH])
@pytest.mark.parametrize("margin_deg", [1.0, 3.0])
def test_the_three_are_the_station_and_two_far_out_east_north_east_and_west_south_west(
    station: Station, margin_deg: float
) -> None:
    found = three_stations(flight(station), station, margin_deg)
    assert found[0].tolist() == station_itrs_m(station).tolist()
    east, north = east_north_m(station, found)
    reach_m = min(670e3, 0.977 * nearest_m(station)) * np.tan(np.radians(margin_deg))
    angle = np.radians(22.5)
    assert east[1:] == pytest.approx([reach_m * np.cos(angle), -reach_m * np.cos(angle)], rel=1e-3)
    assert north[1:] == pytest.approx([reach_m * np.sin(angle), -reach_m * np.sin(angle)], rel=1e-3)
    assert THREE_BEARINGS_DEG.tolist() == [67.5, 247.5]


def nearest_m(station: Station, **more: float) -> float:
    view = flight(station, **more)
    return float(np.linalg.norm(view.satellite_itrs_m - station_itrs_m(station), axis=1).min())


@pytest.mark.parametrize(("height_m", "is_usual"), [(400e3, False), (900e3, True)])
def test_where_the_satellite_comes_nearer_the_two_are_nearer_too(height_m: float, is_usual: bool) -> None:
    found = three_stations(flight(NORTH, height_m), NORTH, 2.0)
    reach_m = 670e3 if is_usual else 0.977 * nearest_m(NORTH, height_m=height_m)
    reach_m *= np.tan(np.radians(2.0))
    assert np.linalg.norm(found[1:] - found[0], axis=1) == pytest.approx([reach_m, reach_m], rel=1e-4)


@pytest.mark.parametrize("station", [NORTH, SOUTH])
def test_the_grid_is_the_three_and_five_rings_to_where_the_margin_less_its_guard_ends(station: Station) -> None:
    assert GUARD_DEG == 0.05
    view = flight(station, count=1001)
    grid = search_grid(view, station, 2.0)
    assert grid.shape == (3 + 5 * 24, 3)
    assert grid[:3].tolist() == three_stations(view, station, 2.0).tolist()
    rings = grid[3:].reshape(5, 24, 3)
    off = off_pointing_deg(view, station_itrs_m(station), rings.reshape(-1, 3)).max(axis=0).reshape(5, 24)
    assert off[-1] == pytest.approx(np.full(24, 2.0 - GUARD_DEG), abs=2e-3)
    assert off.max() <= 2.0 - GUARD_DEG + 1e-3
    assert np.all(np.diff(off, axis=0) > 0.0)
    east, north = east_north_m(station, rings.reshape(-1, 3))
    bearings = np.degrees(np.arctan2(east, north)).reshape(5, 24) % 360.0
    assert np.max(np.abs((bearings - 15.0 * np.arange(24) + 180.0) % 360.0 - 180.0)) < 0.01
    far = np.hypot(east, north).reshape(5, 24)
    assert far / far[-1] == pytest.approx(np.tile((np.arange(1, 6) / 5.0)[:, None], (1, 24)), rel=1e-3)


@pytest.mark.parametrize("side_deg", [-2.0, -0.3, 0.3, 2.0])
def test_the_largest_rate_is_that_of_all_samples_wherever_in_the_pass_it_lies(side_deg: float) -> None:
    view = flight(NORTH, side_deg=side_deg)
    points = ground_points_itrs_m(NORTH, np.arange(8) * 45.0, np.full(8, 60e3))
    true = np.abs(view.az_rates_deg_s(points)).max(axis=0)
    assert peak_rates_deg_s(view, points) == pytest.approx(true, rel=1e-9)
    for part in (slice(0, 2001), slice(2000, 4001)):  # the largest is at the end, at the start
        half = PassView(view.tai_s[part], view.satellite_itrs_m[part], view.gimbal_from_itrs[part])
        true = np.abs(half.az_rates_deg_s(points)).max(axis=0)
        assert peak_rates_deg_s(half, points) == pytest.approx(true, rel=1e-9)


def test_peaks_of_points_far_apart_in_time_are_each_found() -> None:
    view = flight(NORTH, side_deg=0.5)
    points = ground_points_itrs_m(NORTH, np.array([0.0, 180.0, 90.0]), np.array([400e3, 400e3, 10e3]))
    rates = np.abs(view.az_rates_deg_s(points))
    at_s = view.time_s[np.argmax(rates, axis=0)]
    assert at_s[0] > at_s[2] + 20.0 > at_s[1] + 40.0
    assert peak_rates_deg_s(view, points) == pytest.approx(rates.max(axis=0), rel=1e-9)

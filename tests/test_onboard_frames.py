"""Frames of the satellite's antenna against skyfield (Earth, orbit) and scipy (rotations)."""

import numpy as np
import pytest
from onboard_tasks import made_scenario
from scipy.spatial.transform import Rotation
from sgp4.api import WGS72, Satrec
from skyfield.api import EarthSatellite, load, wgs84

from acu_daemon.model import EarthOrientation
from acu_daemon.onboard.gimbal_frames import (
    Gimbal,
    angles_between_deg,
    beam_direction,
    body_from_lvlh,
    boresight_vector,
    mount_matrix,
    roll_pitch_to,
)
from acu_daemon.onboard.scenarios import DAEJEON
from acu_daemon.onboard.view import (
    FINE_S,
    PER_PLAN_STEP,
    PassView,
    gimbal_from_itrs,
    ground_points_itrs_m,
    off_pointing_deg,
    view_pass,
)
from acu_daemon.orbit.frames import station_itrs_m
from acu_daemon.orbit.timescales import utc_days
from acu_daemon.units import DAY_S

FRAMES_DEG = 1e-6
DAY_ZERO_JD, J2000_JD = 2433281.5, 2451545.0


def test_the_gimbals_angles_are_those_of_skyfield_and_scipy_all_through_a_pass() -> None:
    scenario = made_scenario(3, "multi-point")
    elements, seen = scenario.propagator.elements, scenario.seen
    tai_s = np.linspace(seen.rise_tai_s, seen.set_tai_s, 41)
    times = load.timescale(builtin=True)
    days = np.floor(tai_s / DAY_S)
    t = times.tai_jd(J2000_JD + days, tai_s / DAY_S - days)
    orientation = EarthOrientation(ut1_utc_s=float(t.dut1.mean()))
    satrec = Satrec()
    day, fraction = utc_days(np.array(elements.epoch_tai_s))
    satrec.sgp4init(
        WGS72, "i", 0, float(day) - DAY_ZERO_JD + float(fraction), elements.bstar_per_radius, 0.0, 0.0,
        elements.eccentricity, elements.argp_rad, elements.inclination_rad, elements.mean_anomaly_rad,
        elements.mean_motion_rad_s * 60.0, elements.raan_rad,
    )  # fmt: skip
    satellite = EarthSatellite.from_satrec(satrec, times).at(t)
    station = wgs84.latlon(DAEJEON.latitude_deg, DAEJEON.longitude_deg, DAEJEON.height_m).at(t)
    r, v, to_station = satellite.position.km.T, satellite.velocity.km_per_s.T, (station - satellite).position.km.T
    mount = (1.5, -0.7, 12.0)

    z = -r / np.linalg.norm(r, axis=1)[:, None]
    y = -np.cross(r, v)
    y /= np.linalg.norm(y, axis=1)[:, None]
    x = np.cross(y, z)
    lvlh = np.stack([np.einsum("nj,nj->n", one, to_station) for one in (x, y, z)], axis=1)
    angles = scenario.attitude.angles_deg(tai_s)
    body = Rotation.from_euler("ZYX", angles[:, ::-1], degrees=True).inv().apply(lvlh)
    p = Rotation.from_euler("ZYX", mount[::-1], degrees=True).inv().apply(body)
    p /= np.linalg.norm(p, axis=1)[:, None]

    view = PassView(
        tai_s, *gimbal_from_itrs(scenario.propagator, scenario.attitude, mount_matrix(*mount), orientation, tai_s)
    )
    assert angles_between_deg(view.unit(station_itrs_m(DAEJEON)), p).max() < FRAMES_DEG
    gimbal = view.gimbal(station_itrs_m(DAEJEON))
    assert gimbal.el_deg == pytest.approx(np.degrees(np.arccos(p[:, 2])), abs=FRAMES_DEG)
    assert np.tan(np.radians(gimbal.az_deg)) == pytest.approx(p[:, 1] / p[:, 0], rel=FRAMES_DEG)


def test_roll_turns_the_bodys_z_towards_minus_y_and_pitch_turns_it_forward() -> None:
    ten, zero = np.array([10.0]), np.array([0.0])
    rolled = body_from_lvlh(ten, zero, zero)[0].T @ [0.0, 0.0, 1.0]
    pitched = body_from_lvlh(zero, ten, zero)[0].T @ [0.0, 0.0, 1.0]
    assert rolled == pytest.approx([0.0, -np.sin(np.radians(10.0)), np.cos(np.radians(10.0))])
    assert pitched == pytest.approx([np.sin(np.radians(10.0)), 0.0, np.cos(np.radians(10.0))])


def test_roll_and_pitch_point_the_body_at_a_direction() -> None:
    direction = np.array([0.3, -0.2, 0.8])
    roll_deg, pitch_deg = roll_pitch_to(direction)
    matrix = body_from_lvlh(np.array([roll_deg]), np.array([pitch_deg]), np.zeros(1))[0]
    assert matrix @ direction / np.linalg.norm(direction) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_the_beam_of_a_boresight_that_is_off_is_where_scipy_turns_it() -> None:
    gimbal = Gimbal(np.array([-40.0, 130.0]), np.array([5.0, 70.0]))
    boresight = boresight_vector(0.4, -0.3)
    turned = [
        Rotation.from_euler("ZY", [az, el], degrees=True).apply(boresight)
        for az, el in zip(gimbal.az_deg, gimbal.el_deg, strict=True)
    ]
    assert beam_direction(gimbal, boresight) == pytest.approx(np.array(turned), abs=1e-12)


def test_a_point_on_the_ground_is_as_far_off_as_its_distance_over_the_range_says() -> None:
    scenario = made_scenario(0, "nadir")
    view = view_pass(
        scenario.propagator, scenario.attitude, np.eye(3), EarthOrientation(), scenario.seen.rise_tai_s,
        scenario.seen.set_tai_s,
    )  # fmt: skip
    here = station_itrs_m(DAEJEON)
    point = ground_points_itrs_m(DAEJEON, np.array([90.0]), np.array([5000.0]))
    assert np.linalg.norm(point[0] - here) == pytest.approx(5000.0, abs=0.01)
    off = off_pointing_deg(view, here, point)[:, 0]
    a, b = view.unit(here), view.unit(point[0])
    assert off == pytest.approx(angles_between_deg(a, b), abs=1e-9)


@pytest.mark.parametrize("from_s", [0.0, 0.001, 0.4, 0.999])
@pytest.mark.parametrize("for_s", [20.0, 20.1, 20.249, 20.251])
def test_a_view_lies_within_its_pass_from_the_first_whole_second_on_and_ends_less_than_a_plan_step_before_it(
    from_s: float, for_s: float
) -> None:
    scenario = made_scenario(0, "nadir")
    begin = np.floor(scenario.seen.rise_tai_s) + 1.0 + from_s
    view = view_pass(
        *(scenario.propagator, scenario.attitude, np.eye(3), EarthOrientation()), begin, begin + for_s
    )  # fmt: skip
    assert begin <= view.tai_s[0] < begin + 1.0
    assert view.tai_s[0] == np.floor(view.tai_s[0])
    assert begin + for_s - PER_PLAN_STEP * FINE_S < view.tai_s[-1] <= begin + for_s
    assert view.time_s.size % PER_PLAN_STEP == 1
    assert view.step_s == pytest.approx(FINE_S)

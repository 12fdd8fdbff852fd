"""The envelope as an object: limits, zones, sun and skyline, for one direction and for many."""

import erfa
import numpy as np
import pytest

from acu_daemon.model import AxisLimits, Site, Station, sky_angle_deg
from acu_daemon.orbit.celestial import teme_from_gcrf
from acu_daemon.orbit.sun import AU_M, sun_direction_deg, sun_teme_m
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import Disc, KeepOut, Sun
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.skyline import Skyline, skyline_of

AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
SITE = Site(Station("Madrid", 40.43, -4.25, 800.0))
NOON = tai_from_utc("2026-06-21T12:15:00Z")
MAST = KeepOut("the mast", 350.0, 10.0, 0.0, 20.0)


def sun_by_erfa(tai_s: np.ndarray) -> np.ndarray:
    """Unit vectors (N, 3) to the apparent sun in TEME: SOFA's Earth, light time, and aberration by its velocity."""
    tt_days, light_s_per_au = (tai_s + 32.184) / 86400.0, AU_M / 299792458.0
    heliocentric, barycentric = erfa.epv00(2451545.0, tt_days)
    light_days = np.linalg.norm(heliocentric["p"], axis=1) * light_s_per_au / 86400.0
    then_heliocentric, then_barycentric = erfa.epv00(2451545.0, tt_days - light_days)
    way = then_barycentric["p"] - then_heliocentric["p"] - barycentric["p"]
    seen = way / np.linalg.norm(way, axis=1)[:, None] + barycentric["v"] / 86400.0 * light_s_per_au
    turned = np.einsum("nij,nj->ni", teme_from_gcrf(tai_s), seen)
    return turned / np.linalg.norm(turned, axis=1)[:, None]


def test_the_sun_is_where_sofa_has_it_from_1972_to_2060() -> None:
    tai_s = np.linspace(tai_from_utc("1972-01-01T00:00:00Z"), tai_from_utc("2060-01-01T00:00:00Z"), 4001)
    ours = sun_teme_m(tai_s)
    ours /= np.linalg.norm(ours, axis=1)[:, None]
    assert np.degrees(np.linalg.norm(ours - sun_by_erfa(tai_s), axis=1)).max() < 0.001


def test_the_sun_between_two_minutes_is_on_its_arc() -> None:
    sun = Sun(SITE, 3.0)
    tai_s = NOON + np.arange(0.0, 120.0, 5.0)
    for one, az_deg, el_deg in zip(tai_s.tolist(), *sun_direction_deg(tai_s, SITE), strict=True):
        assert sky_angle_deg(*sun.direction_deg(one), float(az_deg), float(el_deg)) < 0.0003


@pytest.mark.parametrize(
    ("az_deg", "height_deg"),
    [(0.0, 4.0), (45.0, 7.0), (90.0, 10.0), (180.0, 2.0), (270.0, 3.0), (315.0, 3.5), (-45.0, 3.5), (405.0, 7.0)],
)
def test_the_skyline_is_straight_between_its_points_and_over_north(az_deg: float, height_deg: float) -> None:
    skyline = skyline_of(((90.0, 10.0), (0.0, 4.0), (180.0, 2.0)))
    assert skyline.height_deg(az_deg) == pytest.approx(height_deg)
    assert skyline.heights_deg(np.array([az_deg, az_deg + 360.0])) == pytest.approx(height_deg)


def test_a_skyline_is_the_same_wherever_north_lies_between_its_points() -> None:
    points = ((0.0, 4.0), (35.0, 11.0), (90.0, 10.0), (180.0, 2.0), (260.0, 21.0), (350.0, 1.0))
    az_deg = np.arange(-720.0, 720.0, 3.7)
    as_it_is = [skyline_of(points).height_deg(one) for one in az_deg]
    for turned_deg in range(0, 360, 15):
        turned = skyline_of(tuple(((az + turned_deg) % 360.0, el) for az, el in points))
        assert [turned.height_deg(one + turned_deg) for one in az_deg] == pytest.approx(as_it_is)
        assert turned.heights_deg(az_deg + turned_deg) == pytest.approx(as_it_is)


def test_a_skyline_of_one_point_is_level_and_of_none_or_two_at_one_azimuth_is_refused() -> None:
    assert skyline_of(((123.0, 7.0),)).height_deg(300.0) == 7.0
    assert skyline_of(((0.0, 7.0), (360.0, 7.0))) == Skyline((0.0,), (7.0,))
    for points, said in (
        ((), "no point"),
        (((0.0, 7.0), (360.0, 8.0)), "two elevations"),
        (((400.0, 1.0),), "0 to 360"),
    ):
        with pytest.raises(ValueError, match=said):
            skyline_of(points)


@pytest.mark.parametrize("ends_deg", [(0.0, 0.0), (0.0, 360.0), (30.0, 30.0), (-90.0, 270.0)])
def test_a_box_whose_azimuths_are_the_same_twice_keeps_the_beam_out_all_around(ends_deg: tuple[float, float]) -> None:
    ring = KeepOut("the ring", *ends_deg, 10.0, 20.0)
    for az_deg in range(-270, 451, 45):
        assert [ring.clearance_deg(az_deg, el_deg) for el_deg in (4.0, 12.0, 15.0, 20.5)] == [6.0, -2.0, -5.0, 0.5]


def test_a_box_over_north_keeps_the_beam_out_on_every_turn() -> None:
    envelope = Envelope(AZIMUTH, ELEVATION, (MAST,))
    for az_deg in (0.0, 355.0 - 360.0, 5.0, -9.0):
        assert envelope.why_not(az_deg, 10.0, NOON) == "within the keep-out of the mast"
        assert envelope.why_not(az_deg, 21.0, NOON) == ""
    assert envelope.room_deg(0.0, 25.0, NOON) == pytest.approx(5.0)
    assert envelope.room_deg(12.0, 0.0, NOON) == pytest.approx(0.0)
    assert envelope.clearance_deg(12.0, 0.0, NOON) == pytest.approx(2.0)
    assert envelope.clearance_deg(0.0, 15.0, NOON) == pytest.approx(-5.0)


def test_the_limits_alone_ask_for_no_sky() -> None:
    envelope = Envelope(AZIMUTH, ELEVATION)
    assert envelope.why_not(270.0, 90.0, float("nan")) == ""
    assert envelope.why_not(270.1, 90.0, NOON) == "azimuth outside -270 to 270 deg"
    assert envelope.why_not(0.0, -0.1, NOON) == "elevation outside 0 to 90 deg"
    assert envelope.why_not(float("nan"), 5.0, NOON).startswith("azimuth outside")


def test_an_antenna_that_plunges_is_asked_about_the_other_side() -> None:
    plunging = AxisLimits(0.0, 180.0, 5.0, 5.0)
    envelope = Envelope(AZIMUTH, plunging, (MAST,), skyline=skyline_of(((0.0, 30.0), (90.0, 0.0), (270.0, 0.0))))
    assert envelope.why_not(180.0, 170.0, NOON) == "within the keep-out of the mast"
    assert envelope.why_not(0.0, 170.0, NOON) == ""
    assert not envelope.sees(180.0, 155.0)
    assert envelope.sees(180.0, 145.0)


def test_the_sun_is_avoided_only_where_the_policy_says_so() -> None:
    az_deg, el_deg = Sun(SITE, 3.0).direction_deg(NOON)
    avoiding, warning = (Envelope(AZIMUTH, ELEVATION, sun=Sun(SITE, 3.0, one)) for one in ("avoid", "warn"))
    assert avoiding.why_not(az_deg, el_deg + 2.9, NOON) == "within the keep-out of the sun"
    assert avoiding.why_not(az_deg, el_deg + 3.1, NOON) == ""
    assert warning.why_not(az_deg, el_deg, NOON) == ""
    assert avoiding.sun is not None
    assert avoiding.sun.angle_deg(az_deg, el_deg + 2.0, NOON) == pytest.approx(2.0)


def test_many_directions_are_answered_as_one() -> None:
    envelope = Envelope(AZIMUTH, ELEVATION, (MAST,), Sun(SITE, 10.0), skyline_of(((0.0, 5.0), (90.0, 40.0))))
    random = np.random.default_rng(1)
    az_deg, el_deg = random.uniform(-300.0, 300.0, 400), random.uniform(-10.0, 100.0, 400)
    tai_s = NOON + random.uniform(0.0, 86400.0, 400)
    rooms, allowed = envelope.rooms_deg(az_deg, el_deg, tai_s), envelope.allows(az_deg, el_deg, tai_s)
    seen = envelope.sees(az_deg, el_deg)
    assert rooms.shape == allowed.shape == seen.shape == (400,)
    for i, (az, el, t) in enumerate(zip(az_deg.tolist(), el_deg.tolist(), tai_s.tolist(), strict=True)):
        assert rooms[i] == envelope.room_deg(az, el, t)
        assert allowed[i] == (envelope.why_not(az, el, t) == "")
        assert seen[i] == (envelope.over_skyline_deg(az, el) >= 0.0)
    assert 50 < allowed.sum() < 350
    assert 50 < seen.sum() < 350


def test_the_beam_of_a_surveyed_mount_is_found_quickly_enough() -> None:
    mount = Mount(ia_deg=35.0, ie_deg=-0.4, ca_deg=0.1, npae_deg=-0.08, an_deg=0.06, aw_deg=-0.06, tf_deg=0.2)
    random = np.random.default_rng(2)
    az_deg, el_deg = random.uniform(-270.0, 270.0, 500), random.uniform(0.0, 89.0, 500)
    exact_az, exact_el = mount.beam_deg(az_deg, el_deg)
    for az, el, at_az, at_el in zip(
        az_deg.tolist(), el_deg.tolist(), exact_az.tolist(), exact_el.tolist(), strict=True
    ):
        assert sky_angle_deg(*mount.beam_near(az, el), at_az, at_el) < 0.01


@pytest.mark.parametrize("el_deg", [0.0, 30.0, 60.0, 80.0, 86.0])
def test_the_box_of_a_disc_holds_it_and_its_rim_is_as_far_as_it_says(el_deg: float) -> None:
    disc = Disc("", 40.0, el_deg, 5.0)
    middle_deg, half_deg, low_deg, high_deg = disc.box_deg(0.5)
    for angle_deg in range(0, 360, 5):
        az, el = disc.at(float(angle_deg), 0.5)
        assert disc.clearance_deg(az, el) == pytest.approx(0.5)
        assert abs(az - middle_deg) <= half_deg + 1e-9
        assert low_deg - 1e-9 <= el <= high_deg + 1e-9
        assert disc.angle_deg(az, el) % 360.0 == pytest.approx(angle_deg, abs=1e-6)

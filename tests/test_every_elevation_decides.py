"""What the decision measures on the sky it measures there at every elevation: azimuth counts by cos(el).

Every place, path and offset is made by rotation of vectors, and none by a formula of the product.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from memories import Judge, remembering

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.axis_latch import watch_antenna
from acu_daemon.control.safety.axis_watch import AxesWatch, AxisSeen, Bounds, Duty, sky_scale, watch_axes
from acu_daemon.control.safety.encoder_watch import FROZEN_DEG, EncoderWatch, watch_encoders
from acu_daemon.control.safety.status_plausibility import CONFIRMED_COUNT, CONFIRMED_DEG, RATE_MARGIN, SLACK_DEG
from acu_daemon.control.state import Scan, StartStage
from acu_daemon.control.tick_input import Observation, PassPlan, Sky, TickInput
from acu_daemon.control.tracking.causes import GLANCE_S, HEARD_BEAMS, ON_POINT_BEAMS, RESUME_DEG, find_causes
from acu_daemon.control.tracking.register_limiter import limit
from acu_daemon.control.tracking.scan import DWELL_S, ON_PLACE_BEAMS, go_on, look, pace_s_s, row_deg
from acu_daemon.control.tracking.state_table import Cause, TrackState
from acu_daemon.control.tracking.track_frame import SIGMAS, beside, offset_of
from acu_daemon.daemon.motion import Motion
from acu_daemon.model import AxisLimits, Model, Pointing, Prediction, Reading
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.units import Array, wrap_180

ELEVATIONS_DEG = (2.0, 20.0, 40.0, 60.0, 74.0, 85.0, 89.0, 89.9)
COURSES_DEG = tuple(range(0, 360, 45))  # 0 is up, 90 is right
NOW = 8.4e8
SKY_DEG_S = 0.5
STEP_S = 0.02  # fine: close to the zenith an azimuth has corners
LEAST_SCALE = 0.01  # of a degree of azimuth on the sky: nearer than half a degree to the zenith it is all noise
QUICK = 1e5  # of a drive that sets no limit here
CONFIG = ControlConfig(
    Envelope(AxisLimits(-3600.0, 3600.0, QUICK, QUICK), AxisLimits(-90.0, 180.0, QUICK, QUICK)),
    min_elevation_deg=-90.0,
    search_along_s=14.0,
    search_across_deg=8.0,
)
el_places = pytest.mark.parametrize("el_deg", ELEVATIONS_DEG)
courses = pytest.mark.parametrize("course_deg", COURSES_DEG)


def frame(az_deg: float, el_deg: float) -> tuple[Array, Array, Array]:
    """Ahead, right and up."""
    az, el = np.radians([az_deg, el_deg])
    ahead = np.array([np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)])
    right = np.array([np.cos(az), -np.sin(az), 0.0])
    return ahead, right, np.cross(right, ahead)


def angles_of(vectors: Array) -> tuple[Array, Array]:
    """Azimuth, continuous along the last axis, and elevation, of (3, N)."""
    az_deg = np.degrees(np.unwrap(np.arctan2(vectors[0], vectors[1])))
    return az_deg, np.degrees(np.arcsin(np.clip(vectors[2], -1.0, 1.0)))


@cache
def great_circle(el_deg: float, course_deg: float, sky_deg_s: float = SKY_DEG_S) -> Prediction:
    """Through azimuth 100 deg at NOW, at an elevation, on a course."""
    ahead, right, up = frame(100.0, el_deg)
    forward = np.sin(np.radians(course_deg)) * right + np.cos(np.radians(course_deg)) * up
    t = STEP_S * np.arange(-1500, 1501)
    far, speed = np.radians(sky_deg_s * t), np.radians(sky_deg_s)
    places = np.outer(ahead, np.cos(far)) + np.outer(forward, np.sin(far))
    motion = speed * (np.outer(forward, np.cos(far)) - np.outer(ahead, np.sin(far)))
    az, el = angles_of(places)
    az += 100.0 - az[1500]
    flat = places[0] ** 2 + places[1] ** 2
    rates = (
        np.degrees((motion[0] * places[1] - places[0] * motion[1]) / flat),
        np.degrees(motion[2] / np.sqrt(flat)),
    )
    return Prediction(NOW + t[0], STEP_S, az, el, *rates, az, rates[0], "TLE", NOW)


def off_path(el_deg: float, course_deg: float, along_deg: float, across_deg: float) -> tuple[float, float]:
    """The direction so far behind on that circle (late), and to the right of it."""
    ahead, right, up = frame(100.0, el_deg)
    forward = np.sin(np.radians(course_deg)) * right + np.cos(np.radians(course_deg)) * up
    pole = np.cross(ahead, forward)  # to the right of the motion, seen from inside: moving right, it is down
    late, aside = np.radians([-along_deg, across_deg])
    here = np.cos(late) * ahead + np.sin(late) * forward
    az, el = angles_of((np.cos(aside) * here + np.sin(aside) * pole)[:, None])
    return 100.0 + wrap_180(float(az[0]) - 100.0), float(el[0])


def apart_deg(one: tuple[float, float], other: tuple[float, float]) -> float:
    first, second = frame(*one)[0], frame(*other)[0]
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second)))


def scale_of(el_deg: float) -> float:
    """Degrees on the sky of a degree of azimuth."""
    return max(abs(float(np.cos(np.radians(el_deg)))), LEAST_SCALE)


# The frame of the track


@el_places
@courses
def test_a_place_beside_the_path_is_where_the_vectors_say_and_is_told_as_what_it_was_made_with(
    el_deg: float, course_deg: float
) -> None:
    path = great_circle(el_deg, course_deg)
    room_deg = min(3.0, 0.5 * (90.0 - el_deg))
    for along_deg, across_deg in ((0.0, room_deg), (0.0, -room_deg), (room_deg, 0.3), (-room_deg, -0.3)):
        place = off_path(el_deg, course_deg, along_deg, across_deg)
        offset = along_deg / SKY_DEG_S, across_deg
        seen = beside(path, NOW, offset)
        assert apart_deg((seen.az_deg, seen.el_deg), place) < 0.01
        told = offset_of(path, NOW, *place)
        assert told == pytest.approx(offset, abs=0.03)


# Search


@el_places
@courses
@pytest.mark.parametrize("side", [-1, 1])
def test_the_search_crosses_a_beam_in_its_time_at_every_elevation(el_deg: float, course_deg: float, side: int) -> None:
    path = great_circle(el_deg, course_deg)
    pace = pace_s_s(Scan(model=Model.ELEMENTS, side=side), path, NOW, CONFIG)
    assert pace * SKY_DEG_S == pytest.approx(CONFIG.beamwidth_deg / DWELL_S, rel=0.01 if el_deg < 89.5 else 0.03)


@el_places
@courses
@pytest.mark.parametrize("row", [0, 1, -1])
def test_a_place_counts_as_seen_as_far_off_as_its_share_of_a_beam_on_the_sky(
    el_deg: float, course_deg: float, row: int
) -> None:
    path = great_circle(el_deg, course_deg)
    far_deg = ON_PLACE_BEAMS * CONFIG.beamwidth_deg
    scan = Scan(model=Model.ELEMENTS, row=row, side=1, along_s=1.0, is_aimed=True)
    for along_deg, across_deg in ((0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0)):
        for share, is_seen in ((0.8, True), (1.25, False)):
            # an antenna is some of the scan's own way behind
            behind_deg = 0.3 * CONFIG.beamwidth_deg / DWELL_S if along_deg else 0.0
            along = SKY_DEG_S + along_deg * (share * far_deg + behind_deg)
            place = off_path(el_deg, course_deg, along, row * row_deg(CONFIG) + across_deg * share * far_deg)
            after = go_on(scan, path, Reading(NOW, place[0] % 360.0, place[1], False), NOW, 0.1, CONFIG)
            assert after.is_moving == is_seen, (along_deg, across_deg, share)


@el_places
def test_a_row_lies_beside_the_path_by_its_part_of_a_beam(el_deg: float) -> None:
    for course_deg in COURSES_DEG:
        path = great_circle(el_deg, course_deg)
        for row in (-3, -1, 1, 3):
            point = look(Scan(model=Model.ELEMENTS, row=row), path, NOW, CONFIG)
            place = off_path(el_deg, course_deg, 0.0, row * 0.7 * CONFIG.beamwidth_deg)
            assert apart_deg((point.az_deg, point.el_deg), place) < 0.01


# Near, on the point, ours


def causes(
    path: Prediction,
    place: tuple[float, float],
    track: TrackState,
    seen: AcuStatus,
    from_rise_s: float,
    in_state_s: float = 1.0,
) -> set[Cause]:
    plan = PassPlan(NOW - from_rise_s, NOW + 500.0, NOW - 200.0, 100.0, path.at(NOW).el_deg)
    seen = replace(seen, az_deg=place[0] % 360.0, el_deg=place[1])
    entered = {"track": track, "entered_tai_s": NOW - in_state_s}
    state = remembering(stage=StartStage.READY, status=seen, az_deg=place[0], **entered)
    return find_causes(state, TickInput(Observation(), Sky(path, None, plan), NOW), CONFIG)


IN_REMOTE = AcuStatus(0.0, 0.0, AcuMode.REMOTE, backup_selected=Backup.REMOTE)
SELECTED = replace(IN_REMOTE, mode=AcuMode.ACQUIRE, is_autotrack_selected=True)
LOCKED = replace(SELECTED, mode=AcuMode.AUTOTRACK, is_acquired=True)


@el_places
@courses
def test_the_antenna_is_on_the_point_within_its_part_of_a_beam_on_the_sky(el_deg: float, course_deg: float) -> None:
    path = great_circle(el_deg, course_deg)
    moved_deg = 0.15 * SKY_DEG_S  # since the reading
    for side in (-1.0, 1.0):
        for share, is_there in ((0.9, True), (1.1, False)):
            far_deg = share * (ON_POINT_BEAMS * CONFIG.beamwidth_deg + moved_deg)
            place = off_path(el_deg, course_deg, 0.0, side * far_deg)
            if abs(place[0] - 100.0) < 90.0:
                found = causes(path, place, TrackState.PREPOSITION, IN_REMOTE, 1.0)
                assert (Cause.ON_POINT in found) == is_there


@el_places
@courses
def test_on_another_turn_a_signal_is_heard_within_a_beam_on_the_sky(el_deg: float, course_deg: float) -> None:
    path = great_circle(el_deg, course_deg)
    heard = replace(IN_REMOTE, is_acquired=True)
    for share, is_heard in ((0.9, True), (1.1, False)):
        far_deg = share * (HEARD_BEAMS * CONFIG.beamwidth_deg + 0.15 * SKY_DEG_S)
        az_deg, el = off_path(el_deg, course_deg, 0.0, far_deg)
        if abs(az_deg - 100.0) < 90.0:
            for turn_deg in (-360.0, 360.0):
                found = causes(path, (az_deg + turn_deg, el), TrackState.PREPOSITION, heard, 1.0)
                assert (Cause.ON_POINT in found) == is_heard


@el_places
@courses
def test_autotrack_that_is_still_selected_goes_on_within_five_degrees_on_the_sky(
    el_deg: float, course_deg: float
) -> None:
    path = great_circle(el_deg, course_deg)
    for side in (-1.0, 1.0):
        for share, goes_on in ((0.9, True), (1.1, False)):
            place = off_path(el_deg, course_deg, 0.0, side * share * (RESUME_DEG + 0.15 * SKY_DEG_S))
            assert (Cause.STILL_SELECTED in causes(path, place, TrackState.IDLE, SELECTED, 1.0)) == goes_on


@el_places
@courses
def test_a_glance_is_short_where_the_time_in_doubt_is_more_than_half_a_beam_on_the_sky(
    el_deg: float, course_deg: float
) -> None:
    place = (100.0, el_deg)
    for share, is_short in ((0.9, False), (1.1, True)):
        late_s = share * CONFIG.beamwidth_deg / 2.0 / SKY_DEG_S / SIGMAS
        path = replace(great_circle(el_deg, course_deg), spread=(late_s, 0.0))
        found = causes(
            path, place, TrackState.ACQUIRE_TLE, SELECTED, 50.0, in_state_s=GLANCE_S[TrackState.ACQUIRE_TLE] + 1.0
        )
        assert (Cause.ACQUIRE_OVER in found) == is_short


@pytest.mark.parametrize("el_deg", [20.0, 40.0, 60.0, 74.0])
@courses
def test_what_is_held_beside_the_path_is_ours_as_far_as_the_search_would_look(el_deg: float, course_deg: float) -> None:
    path = great_circle(el_deg, course_deg)
    for side in (-1.0, 1.0):
        for share, is_ours in ((0.95, True), (1.05, False)):
            across = off_path(el_deg, course_deg, 0.0, side * share * CONFIG.search_across_deg)
            along = off_path(el_deg, course_deg, side * share * CONFIG.search_along_s * SKY_DEG_S, 0.0)
            for place in (across, along):
                found = causes(path, place, TrackState.IDLE, LOCKED, 1.0)
                assert (Cause.ACQUIRED in found) == is_ours, (side, share, place)


# The axes


@pytest.mark.parametrize("el_deg", [*ELEVATIONS_DEG, -5.0, 120.0])
@pytest.mark.parametrize("side", [-1, 1])
def test_p6_an_azimuth_is_judged_by_its_angle_on_the_sky(el_deg: float, side: int) -> None:
    """That stands away from its command, and that moves without one."""
    wide = AxisLimits(-270.0, 270.0, 20.0, 10.0)
    bounds = Bounds(1.0, 2.0)
    scale = sky_scale(el_deg)
    assert scale == pytest.approx(scale_of(el_deg), abs=1e-9)
    status = replace(IN_REMOTE, el_deg=el_deg)
    for share, is_wrong in ((0.9, False), (1.1, True)):
        off_deg = side * share * bounds.error_deg / scale
        for duty in (Duty.FOLLOW, Duty.STAND):
            watch, problems = AxesWatch(), set()
            for k in range(60):
                moved = off_deg * min(k / 20.0, 1.0) if duty is Duty.STAND else 0.0
                gap = off_deg - moved if duty is Duty.FOLLOW else None
                az = AxisSeen(NOW + 0.1 * k, 10.0 + moved, 0.0, duty, gap, scale)
                el = AxisSeen(NOW + 0.1 * k, el_deg, 0.0, duty, 0.0)
                watch, problem = watch_axes(watch, status, az, el, (wide, wide), bounds)
                problems.add(problem)
            assert (problems != {""}) == is_wrong, duty


@pytest.mark.parametrize("el_deg", ELEVATIONS_DEG)
@pytest.mark.parametrize("side", [-1, 1])
def test_p6_a_latch_waits_for_an_azimuth_that_is_a_degree_behind_on_the_sky(el_deg: float, side: int) -> None:
    """The same by the memory of a tick: readings as they come, and the command in force."""
    bounds = CONFIG.following
    status = replace(IN_REMOTE, az_deg=100.0, el_deg=el_deg)
    for share, is_wrong in ((0.9, False), (1.1, True)):
        behind_deg = side * share * bounds.error_deg / scale_of(el_deg)
        state, problems = remembering(stage=StartStage.READY, track=TrackState.HOLD_FITTED), set()
        for k in range(60):
            now = NOW + 0.1 * k
            readings = tuple((now - 0.1 * back, 100.0, el_deg) for back in (2, 1, 0))
            state = remembering(
                state, az_deg=100.0, track_of_readings=readings, in_force=(now, 100.0 + behind_deg, el_deg)
            )
            seen = Observation(reading=Reading(now, 100.0, el_deg, False), status=status)
            state, problem = watch_antenna(state, seen, CONFIG)
            problems.add(problem)
        assert (problems != {""}) == is_wrong, (share, problems)


@el_places
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("az_deg", [0.0, 100.0])
def test_a_status_is_doubted_and_confirmed_by_its_angle_on_the_sky(el_deg: float, side: int, az_deg: float) -> None:
    drive = AxisLimits(-270.0, 270.0, 2.0, 10.0)
    here = AcuStatus(az_deg, el_deg, AcuMode.STANDBY)
    cos_el = scale_of(el_deg)
    for share, is_believed in ((0.9, True), (1.1, False)):
        doubt = Judge(drive, drive)
        doubt.believes(here, NOW)
        jump_deg = share * (SLACK_DEG / cos_el + RATE_MARGIN * 0.1 * drive.max_rate_deg_s)
        assert doubt.believes(replace(here, az_deg=(az_deg + side * jump_deg) % 360.0), NOW + 0.1) == is_believed
        doubt = Judge(drive, drive)
        for k in range(CONFIRMED_COUNT):
            place = (az_deg + side * k * share * CONFIRMED_DEG / cos_el) % 360.0
            doubt.believes(replace(here, az_deg=place), NOW + 0.1 * k)
        assert doubt.known.is_confirmed == is_believed


@el_places
@pytest.mark.parametrize("side", [-1, 1])
def test_an_encoder_is_frozen_once_the_satellite_has_moved_so_far_on_the_sky(el_deg: float, side: int) -> None:
    cos_el = scale_of(el_deg)
    status = AcuStatus(100.0, el_deg, AcuMode.AUTOTRACK)
    for moved_deg, is_frozen in ((0.9 * FROZEN_DEG, False), (1.1 * FROZEN_DEG, True)):
        path = Pointing(100.0, el_deg, side * moved_deg / cos_el, 0.0)  # in a second
        watch = EncoderWatch()
        for k in range(11):
            watch = watch_encoders(watch, NOW + 0.1 * k, status, path)
        assert (watch.problem == "azimuth encoder frozen") == is_frozen


@pytest.mark.parametrize("el_deg", [5.0, 30.0, 50.0, 65.0, 78.0, 85.0, 89.0])
@pytest.mark.parametrize("side", [-1, 1])
def test_an_azimuth_that_comes_to_its_path_enters_the_beam_as_slowly_at_every_elevation(
    el_deg: float, side: int
) -> None:
    """Half a beam in no less than 1.2 s, from its edge to the satellite."""
    config = ControlConfig(Envelope(AxisLimits(-270.0, 270.0, 20.0, 20.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
    cos_el = float(np.cos(np.radians(el_deg)))
    status = replace(IN_REMOTE, az_deg=100.0, el_deg=el_deg)
    register, left_deg = AxisState(100.0 - side * 6.0 / cos_el), [6.0]
    while left_deg[-1] > 0.5:
        readings = ((NOW - 0.1, register.position_deg, el_deg),)
        state = remembering(
            status=status, axis_az=register, axis_el=AxisState(el_deg), was_followed=True, track_of_readings=readings
        )
        register = limit(Pointing(100.0, el_deg, 0.0, 0.0), state, NOW, is_followed=True, dt_s=0.1, config=config).az
        left_deg.append(abs(register.position_deg - 100.0) * cos_el)
        assert len(left_deg) < 200
    assert left_deg[-2] - left_deg[-1] < 1.2 * 0.1 * 0.5 / 1.2


@pytest.mark.parametrize("side", [-1, 1])
def test_an_elevation_that_outruns_its_drive_is_doubted_and_one_that_moves_is_not_confirmed_both_ways(
    side: int,
) -> None:
    drive = AxisLimits(-270.0, 270.0, 2.0, 10.0)
    here = AcuStatus(100.0, 40.0, AcuMode.STANDBY)
    for share, is_believed in ((0.9, True), (1.1, False)):
        doubt = Judge(drive, drive)
        doubt.believes(here, NOW)
        jump_deg = side * share * (SLACK_DEG + RATE_MARGIN * 0.1 * drive.max_rate_deg_s)
        assert doubt.believes(replace(here, el_deg=40.0 + jump_deg), NOW + 0.1) == is_believed
        doubt = Judge(drive, drive)
        for k in range(CONFIRMED_COUNT):
            doubt.believes(replace(here, el_deg=40.0 + side * k * share * CONFIRMED_DEG), NOW + 0.1 * k)
        assert doubt.known.is_confirmed == is_believed


@el_places
@courses
def test_an_antenna_is_as_fast_as_it_moves_on_the_sky(el_deg: float, course_deg: float) -> None:
    path, motion = great_circle(el_deg, course_deg, 0.05), Motion()
    for k in range(21):
        at = path.at(NOW + 0.1 * k)
        motion.add(Reading(NOW + 0.1 * k, at.az_deg % 360.0, at.el_deg, False))
    assert motion.speed_deg_s(NOW + 2.0) == pytest.approx(0.05, rel=0.05 if el_deg < 89.5 else 0.1)

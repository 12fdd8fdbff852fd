"""Attitudes of the satellite: plans, and CCSDS messages of both versions against scipy's rotations."""

import numpy as np
import pytest
from conftest import DATA, needs_data
from made_aems import kvn, quaternions
from onboard_tasks import made_scenario
from scipy.spatial.transform import Rotation

from acu_daemon.errors import AttitudeError
from acu_daemon.model import EarthOrientation
from acu_daemon.onboard.aem import matrices, parse_aem
from acu_daemon.onboard.aem_attitude import AemAttitude, interpolated
from acu_daemon.onboard.attitude import Agility, AttitudePlan, Hold, plan_attitude
from acu_daemon.onboard.gimbal_frames import lvlh_from_inertial
from acu_daemon.orbit.celestial import teme_from_eme2000, teme_from_gcrf, teme_from_tod
from acu_daemon.orbit.frames import teme_from_itrs
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import Array

START_TAI_S = tai_from_utc("2015-06-01T04:00:00Z")
FRAMES_DEG, FILE_DIGITS_DEG, CUBIC_DEG = 1e-6, 2e-4, 1e-3


def plan() -> AttitudePlan:
    holds = [
        Hold(START_TAI_S, START_TAI_S + 20.0),
        Hold(START_TAI_S + 80.0, START_TAI_S + 100.0, 25.0, -10.0, 5.0, is_imaging=True),
    ]
    return plan_attitude(holds, Agility())


def turned_deg(a: Array, b: Array) -> float:
    return float(np.degrees(Rotation.from_matrix(a @ b.transpose(0, 2, 1)).magnitude()).max())


def sampled(step_s: float = 1.0) -> tuple[Array, Array, Array]:
    tai_s = START_TAI_S + np.arange(0.0, 100.0 + step_s / 2.0, step_s)
    lvlh = np.broadcast_to(np.eye(3), (tai_s.size, 3, 3))
    return tai_s, lvlh, plan().body_from_lvlh(tai_s, lvlh)


def test_a_slew_keeps_to_the_bodys_rate_and_acceleration() -> None:
    tai_s = START_TAI_S + np.arange(0.0, 100.0, 0.01)
    angles = plan().angles_deg(tai_s)
    rate = np.gradient(angles, 0.01, axis=0)
    assert np.abs(rate).max() <= 1.0
    assert np.abs(np.gradient(rate, 0.01, axis=0)).max() <= 0.0501
    assert angles[-1] == pytest.approx([25.0, -10.0, 5.0])


def test_holds_that_leave_no_time_for_the_slew_are_refused_with_the_time_it_takes() -> None:
    holds = [Hold(START_TAI_S, START_TAI_S + 20.0), Hold(START_TAI_S + 40.0, START_TAI_S + 60.0, 25.0)]
    with pytest.raises(AttitudeError, match=r"20\.0 s; the slew of 25\.0 deg takes 58\.7 s"):
        plan_attitude(holds, Agility())


def test_a_strip_may_follow_a_hold_of_the_same_angles_at_once() -> None:
    holds = [Hold(START_TAI_S, START_TAI_S + 20.0, 5.0), Hold(START_TAI_S + 20.0, START_TAI_S + 40.0, 5.0)]
    angles = plan_attitude(holds, Agility()).angles_deg(START_TAI_S + np.linspace(0.0, 40.0, 81))
    assert angles[:, 0] == pytest.approx(np.full(81, 5.0))


def test_a_hold_beyond_what_the_body_turns_is_refused() -> None:
    with pytest.raises(AttitudeError, match=r"40\.0 deg of roll"):
        plan_attitude([Hold(START_TAI_S, START_TAI_S + 5.0, 40.0)], Agility())


def test_a_file_gives_the_attitude_back_between_its_states() -> None:
    tai_s, _, body = sampled()
    (segment,), problems = parse_aem(kvn(quaternions(body), tai_s), "a.aem")
    assert not problems
    between = START_TAI_S + np.arange(0.5, 100.0, 1.0)
    lvlh = np.broadcast_to(np.eye(3), (between.size, 3, 3))
    ours = AemAttitude([segment], EarthOrientation()).body_from_lvlh(between, lvlh)
    assert turned_deg(ours, plan().body_from_lvlh(between, lvlh)) < CUBIC_DEG


@pytest.mark.parametrize("fields", [{"QUATERNION_TYPE": "FIRST"}, {"ATTITUDE_DIR": "B2A"}, {}])
def test_both_versions_say_the_same(fields: dict[str, str]) -> None:
    tai_s, _, body = sampled()
    q = quaternions(body)
    if fields.get("QUATERNION_TYPE") == "FIRST":
        q = np.roll(q, 1, axis=1)
    if fields.get("ATTITUDE_DIR") == "B2A":
        q = q * [-1.0, -1.0, -1.0, 1.0]
    (segment,), problems = parse_aem(kvn(q, tai_s, **fields), "a.aem")
    assert not problems
    assert turned_deg(matrices(segment.quaternion), body) < FRAMES_DEG


@pytest.mark.parametrize("sequence", ["ZYX", "ZXZ", "312"])
def test_euler_angles_are_turned_in_their_sequence(sequence: str) -> None:
    tai_s, _, body = sampled()
    axes = sequence.translate(str.maketrans("123", "XYZ"))
    if axes == "ZXZ":  # not the first states: without a turn about X there is no telling one Z from the other
        tai_s, body = tai_s[50:], body[50:]
    angles = Rotation.from_matrix(body).inv().as_euler(axes, degrees=True)
    (segment,), problems = parse_aem(kvn(angles, tai_s, ATTITUDE_TYPE="EULER_ANGLE", EULER_ROT_SEQ=sequence), "a.aem")
    assert not problems
    assert turned_deg(matrices(segment.quaternion), body) < FRAMES_DEG


def teme_from(frame: str, tai_s: Array, r_m: Array, v_m_s: Array) -> Array:
    """Rotations (N, 3, 3) that turn coordinates of the frame into TEME ones."""
    if frame == "RTN":
        normal = np.cross(r_m, v_m_s)
        axes = np.stack([r_m, np.cross(normal, r_m), normal], axis=2)
        return axes / np.linalg.norm(axes, axis=1)[:, None]
    if frame == "ITRF2014":
        return np.stack([teme_from_itrs(axis, tai_s, EarthOrientation()) for axis in np.eye(3)], axis=2)
    known = {"EME2000": teme_from_eme2000, "GCRF": teme_from_gcrf, "TOD": teme_from_tod}
    return known[frame](tai_s) if frame in known else np.broadcast_to(np.eye(3), (tai_s.size, 3, 3))


@pytest.mark.parametrize("frame", ["EME2000", "GCRF", "TEME", "TOD", "ITRF2014", "RTN"])
def test_an_attitude_in_another_frame_is_turned_to_lvlh(frame: str) -> None:
    scenario = made_scenario(3)
    tai_s = scenario.seen.rise_tai_s + np.arange(0.0, 30.0, 0.5)
    r_m, v_m_s = scenario.propagator.states_teme(tai_s)
    lvlh = lvlh_from_inertial(r_m, v_m_s)
    body = scenario.attitude.body_from_lvlh(tai_s, lvlh)
    (as_lvlh,), _ = parse_aem(kvn(quaternions(body), tai_s), "a.aem")
    source = AemAttitude([as_lvlh], EarthOrientation())
    in_frame = body @ lvlh @ teme_from(frame, tai_s, r_m, v_m_s)
    (segment,), problems = parse_aem(kvn(quaternions(in_frame), tai_s, REF_FRAME_A=frame), "b.aem")
    assert not problems
    at = tai_s[:-1] + 0.25
    lvlh_at = lvlh_from_inertial(*scenario.propagator.states_teme(at))
    ours = AemAttitude([segment], EarthOrientation()).body_from_lvlh(at, lvlh_at)
    assert turned_deg(ours, source.body_from_lvlh(at, lvlh_at)) < FRAMES_DEG


def test_a_gap_is_refused_where_the_attitude_turns_and_passes_where_it_rests() -> None:
    tai_s, lvlh, body = sampled()
    q = quaternions(body)
    turning = np.ones(tai_s.size, bool)
    turning[48:52] = False
    (segment,), _ = parse_aem(kvn(q[turning], tai_s[turning]), "a.aem")
    attitude = AemAttitude([segment], EarthOrientation())
    with pytest.raises(AttitudeError, match=r"line 63: a gap of 5\.0 s .* get a file without the gap"):
        attitude.body_from_lvlh(tai_s, lvlh)
    before_it = slice(0, 40)
    assert turned_deg(attitude.body_from_lvlh(tai_s[before_it], lvlh[before_it]), body[before_it]) < FRAMES_DEG
    resting = np.ones(tai_s.size, bool)
    resting[5:9] = False
    (segment,), _ = parse_aem(kvn(q[resting], tai_s[resting]), "a.aem")
    assert turned_deg(AemAttitude([segment], EarthOrientation()).body_from_lvlh(tai_s, lvlh), body) < FRAMES_DEG


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"REF_FRAME_A": "MOON_ME"}, "the reference frame is 'MOON_ME'"),
        ({"REF_FRAME_B": "STR_1"}, "one must be SC_BODY or SC_BODY_n; name the body's frame by"),
        ({"ATTITUDE_TYPE": "SPIN"}, "QUATERNION and EULER_ANGLE"),
        ({"TIME_SYSTEM": "MET"}, "TIME_SYSTEM is 'MET'"),
    ],
)
def test_what_cannot_be_used_is_told_with_what_can(fields: dict[str, str], said: str) -> None:
    tai_s, _, body = sampled()
    segments, problems = parse_aem(kvn(quaternions(body), tai_s, **fields), "a.aem")
    assert not segments
    assert said in str(problems[0])


def test_a_pass_that_the_attitude_does_not_cover_is_told_with_both_spans() -> None:
    tai_s, lvlh, body = sampled()
    (segment,), _ = parse_aem(kvn(quaternions(body), tai_s), "a.aem")
    with pytest.raises(AttitudeError, match="get a longer file, or raise min_elevation_deg"):
        AemAttitude([segment], EarthOrientation()).body_from_lvlh(tai_s + 1.0, lvlh)


@needs_data
def test_orekits_version_1_example_in_xml_is_read_with_its_body_named() -> None:
    text = (DATA / "orbits" / "AEMExample13.xml").read_text()
    segments, problems = parse_aem(text, "13")
    assert not segments
    assert "body_frame" in str(problems[0])
    (segment,), problems = parse_aem(text, "13", "IMU_FRAME_1")
    assert not problems
    assert segment.reference == "LVLH"
    assert segment.quaternion[0] == pytest.approx([0.40215691, -0.58162787, -0.51111088, 0.48861489], abs=1e-8)


@needs_data
def test_orekits_version_2_example_says_the_same_in_quaternions_and_euler_angles() -> None:
    segments, problems = parse_aem((DATA / "orbits" / "AEMExample14.txt").read_text(), "14")
    assert [one.line for one in problems] == [33]
    assert "SPIN/NUTATION_MOM" in str(problems[0])
    as_quaternion, as_euler = (matrices(one.quaternion) for one in segments[-2:])
    assert turned_deg(as_quaternion, as_euler) < FILE_DIGITS_DEG


@needs_data
def test_a_spinner_with_one_state_in_half_a_turn_is_refused() -> None:
    segments, _ = parse_aem((DATA / "orbits" / "AEMExample14.txt").read_text(), "14")
    assert all(len(one.gaps) == one.tai_s.size - 1 for one in segments)
    at = segments[-1].tai_s[:1] + np.array([1.0])
    with pytest.raises(AttitudeError, match=r"a gap of 10\.0 s"):
        AemAttitude(segments[-1:], EarthOrientation()).body_from_lvlh(at, np.eye(3)[None])


def test_interpolation_meets_the_states_themselves() -> None:
    tai_s, _, body = sampled()
    (segment,), _ = parse_aem(kvn(quaternions(body), tai_s), "a.aem")
    assert interpolated(segment.tai_s, segment.quaternion, segment.tai_s) == pytest.approx(segment.quaternion)

"""An ephemeris as a source of orbits: interpolation against held-back states, frames, spans, and corrections."""

import pickle

import numpy as np
import pytest
import real_passes
from conftest import needs_data
from made_oems import NO_ORIENTATION, START, States, iss, kvn, source, states, xml
from made_orbits import circular
from real_passes import RealPass, noisy, sky_angles_deg
from skyfield.api import load
from skyfield.framelib import ICRS_to_J2000
from skyfield.sgp4lib import TEME

from acu_daemon.assist.estimators.estimator import EstimatorSettings, make_estimator
from acu_daemon.errors import ElementsError, OrbitError
from acu_daemon.model import Correction, EarthOrientation, Readings, Site, Station
from acu_daemon.orbit.frames import enu_from_itrs, itrs_from_teme, station_itrs_m
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import spans_tai_s
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.units import DAY_S, EARTH_RATE_RAD_S, Array

ASKED_M = 1.0  # against held-back states
TURNED = EarthOrientation(ut1_utc_s=-0.11, polar_x_arcsec=0.02, polar_y_arcsec=0.35)
SITE = Site(Station("Huntsville", 34.73, -86.58, 190.0))
SIGMA_DEG = 0.03


def worst_m(differences: Array) -> float:
    return float(np.linalg.norm(differences, axis=1).max())


def kept(of: States, every: int = 2) -> States:
    """Every second state, or every so many."""
    tai_s, r_m, v_m_s = of
    return tai_s[::every], r_m[::every], v_m_s[::every]


def turned(of: States, rotation: Array) -> States:
    tai_s, r_m, v_m_s = of
    return tai_s, (rotation @ r_m[..., None])[..., 0], (rotation @ v_m_s[..., None])[..., 0]


def from_teme(of: States, frame: str) -> States:
    """States in TEME turned into another frame, into a celestial one by Skyfield."""
    tai_s, r_m, v_m_s = of
    if frame == "TEME":
        return of
    if frame.startswith("ITRF"):
        return tai_s, *itrs_from_teme(r_m, v_m_s, tai_s, TURNED)
    when = load.timescale(builtin=True).tt_jd(2451545.0, (tai_s + 32.184) / DAY_S)
    in_gcrf = turned(of, np.moveaxis(np.asarray(TEME.rotation_at(when)), (0, 1), (2, 1)))
    if frame == "TOD":
        return turned(in_gcrf, np.moveaxis(when.M, -1, 0))
    return turned(in_gcrf, np.asarray(ICRS_to_J2000) if frame == "EME2000" else np.eye(3))


@pytest.mark.parametrize("frame", ["TEME", "TOD", "EME2000", "GCRF", "ITRF2014"])
def test_held_back_states_are_met_to_less_than_a_metre_in_every_frame(frame: str) -> None:
    fine = states(step_s=30.0)  # 60 s are kept
    oem = source(kvn(from_teme(kept(fine), frame), REF_FRAME=frame), TURNED)
    r_m, v_m_s = oem.states_teme(fine[0])
    assert worst_m(r_m - fine[1]) < ASKED_M
    assert worst_m(v_m_s - fine[2]) < 0.1  # those of SGP4 are no exact derivatives


@pytest.fixture(scope="module")
def integrated() -> tuple[States, States]:
    """Two hours of an orbit of 400 km by brahe, field to degree and order 40, drag: GCRF and its own ITRF."""
    brahe = pytest.importorskip("brahe")
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    utc, value = "2026-06-01T00:00:00Z", brahe.ParameterSource.value
    drag = brahe.DragConfiguration(brahe.AtmosphericModel.HARRIS_PRIESTER, value(10.0), value(2.2))
    gravity = brahe.GravityConfiguration.spherical_harmonic(40, 40)
    start = np.array([6778e3, 0.0, 0.0, 0.0, 4763.0, 6009.0])
    orbit = brahe.NumericalOrbitPropagator(
        brahe.Epoch(utc),
        start,
        brahe.NumericalPropagationConfig.high_precision(),
        brahe.ForceModelConfig(gravity=gravity, drag=drag, mass=value(1000.0)),
    )
    seconds = np.arange(0.0, 7201.0, 30.0)
    epochs = [brahe.Epoch(utc) + float(x) for x in seconds]
    gcrf = np.empty((seconds.size, 6))
    for k, when in enumerate(epochs):
        orbit.propagate_to(when)
        gcrf[k] = orbit.current_state()
    itrf = np.asarray(brahe.state_gcrf_to_itrf(epochs, gcrf))
    tai_s = tai_from_utc(utc) + seconds
    return (tai_s, gcrf[:, :3], gcrf[:, 3:]), (tai_s, itrf[:, :3], itrf[:, 3:])


@pytest.mark.parametrize(
    ("frame", "step_s", "least_m"),
    [
        *((frame, step_s, ASKED_M) for frame in ("GCRF", "ITRF") for step_s in (60, 120, 180, 240)),
        ("ITRF", 600, 20.0),
    ],
)
def test_an_integrated_orbit_is_met_on_the_ground_between_its_states(
    integrated: tuple[States, States], frame: str, step_s: int, least_m: float
) -> None:
    gcrf, itrf = integrated
    given = gcrf if frame == "GCRF" else itrf
    oem = source(kvn(kept(given, step_s // 30), REF_FRAME=frame))
    tai_s = itrf[0]
    r_itrs_m, _ = itrs_from_teme(*oem.states_teme(tai_s), tai_s, NO_ORIENTATION)
    assert worst_m(r_itrs_m - itrf[1]) < least_m


@pytest.mark.parametrize("step_s", [120, 180])
def test_what_the_file_recommends_of_interpolation_changes_nothing(
    integrated: tuple[States, States], step_s: int
) -> None:
    gcrf, _ = integrated
    every = kept(gcrf, step_s // 30)
    plain = source(kvn(every, REF_FRAME="GCRF")).states_teme(gcrf[0])[0]
    for method, degree in (("LAGRANGE", "9"), ("HERMITE", "3"), ("LINEAR", "1")):
        oem = source(kvn(every, REF_FRAME="GCRF", INTERPOLATION=method, INTERPOLATION_DEGREE=degree))
        assert np.array_equal(oem.states_teme(gcrf[0])[0], plain)


def test_states_outside_the_useable_span_still_serve_the_interpolation() -> None:
    fine = states(step_s=60.0)
    useable = {
        key: utc_text(START + at_s, 3).removesuffix("Z")
        for key, at_s in (("USEABLE_START_TIME", 300.0), ("USEABLE_STOP_TIME", 6900.0))
    }
    oem = source(kvn(kept(fine, 3), **useable))
    inside = slice(5, -5)
    assert oem.spans_tai_s == ((START + 300.0, START + 6900.0),)
    assert np.array_equal(
        oem.states_teme(fine[0][inside])[0], source(kvn(kept(fine, 3))).states_teme(fine[0][inside])[0]
    )
    with pytest.raises(OrbitError, match="no position at"):
        oem.states_teme(fine[0][4:5])


@pytest.mark.parametrize(
    ("created", "epoch_s"), [("2022-02-11T00:00:00", 0.0), ("2022-02-11T21:00:00.000Z", 3600.0), ("x", 0.0)]
)
@pytest.mark.parametrize("write", [kvn, xml])
def test_the_epoch_is_the_creation_of_the_message_within_its_span(write, created: str, epoch_s: float) -> None:
    text = write(states()).replace("2022-02-11T00:00:00\nORIG", f"{created}\nORIG")
    text = text.replace("<ORIGINATOR>", f"<CREATION_DATE>{created}</CREATION_DATE><ORIGINATOR>")
    assert source(text).epoch_tai_s == pytest.approx(START + epoch_s, abs=1e-6)


def test_a_creation_in_a_gap_or_after_the_end_is_taken_to_the_last_state_before() -> None:
    both = kvn(states(600.0), states(600.0, start_tai_s=START + 900.0))
    for created, epoch_s in (("20:12:00", 600.0), ("23:00:00", 1500.0)):
        oem = source(both.replace("2022-02-11T00:00:00\n", f"2022-02-11T{created}\n"))
        assert oem.epoch_tai_s == pytest.approx(START + epoch_s, abs=1e-6)
        oem.states_teme(np.array([oem.epoch_tai_s]))


def test_positions_in_whole_metres_cost_no_more_than_their_rounding() -> None:
    tai_s, r_m, v_m_s = states(step_s=30.0)
    every_minute = kept((tai_s, np.round(r_m), np.round(v_m_s, 3)))
    assert worst_m(source(kvn(every_minute)).states_teme(tai_s)[0] - r_m) < 1.5


def test_an_earth_fixed_ephemeris_gives_the_same_angles_whatever_the_earth_orientation() -> None:
    earth_fixed = kvn(from_teme(states(), "ITRF2014"), REF_FRAME="ITRF2014")
    tai_s = np.arange(START, START + 7200.0, 97.0)
    first, second = (
        look_at(source(earth_fixed, orientation), tai_s, Site(SITE.station, orientation))
        for orientation in (TURNED, EarthOrientation(ut1_utc_s=0.5))
    )
    assert sky_angles_deg(first.az_deg, first.el_deg, second.az_deg, second.el_deg).max() < 1e-6


def test_two_and_three_states_are_interpolated_too() -> None:
    for count in (2, 3):
        fine = states(60.0 * (count - 1), 10.0)
        assert worst_m(source(kvn(kept(fine, 6))).states_teme(fine[0])[0] - fine[1]) < ASKED_M


def test_states_at_uneven_times_are_interpolated(integrated: tuple[States, States]) -> None:
    (tai_s, r_m, v_m_s), _ = integrated
    pick = np.cumsum(np.random.default_rng(2).integers(1, 5, 60))  # 30 s to 2 min
    pick = pick[pick < tai_s.size]
    oem = source(kvn((tai_s[pick], r_m[pick], v_m_s[pick]), REF_FRAME="TEME"))
    inside = slice(pick[0], pick[-1] + 1)
    assert worst_m(oem.states_teme(tai_s[inside])[0] - r_m[inside]) < ASKED_M


def test_outside_the_span_the_error_names_it() -> None:
    oem = source(kvn(states(600.0)))
    for away_s in (-0.1, 600.1):
        with pytest.raises(OrbitError, match="covers 2022-02-11T20:00:00Z to 2022-02-11T20:10:00Z") as error:
            oem.states_teme(START + np.array([5.0, away_s]))
        assert str(error.value).startswith("ISS (1998-067-A): no position at 2022-02-11T")
    with pytest.raises(OrbitError, match="not finite"):
        oem.states_teme(np.array([np.nan]))
    oem.states_teme(START + np.array([0.0, 600.0]))


def test_segments_that_touch_make_one_span_and_the_later_one_counts() -> None:
    tai_s = START + 600.0 + 60.0 * np.arange(11.0)
    other = iss().corrected(Correction(delta_inclination_rad=1e-3))
    oem = source(kvn(states(600.0), (tai_s, *other.states_teme(tai_s))))
    assert spans_tai_s(oem) == ((START, START + 1200.0),)
    at = START + np.array([595.0, 600.0, 605.0])
    wanted_m = np.vstack([iss().states_teme(at[:1])[0], other.states_teme(at[1:])[0]])
    assert worst_m(oem.states_teme(at)[0] - wanted_m) < ASKED_M


def test_a_gap_between_segments_has_no_answer() -> None:
    oem = source(kvn(states(600.0), states(600.0, start_tai_s=START + 900.0)))
    assert len(spans_tai_s(oem)) == 2
    with pytest.raises(OrbitError, match=r"covers .* and 2022-02-11T20:15:00Z to"):
        oem.states_teme(np.array([START + 700.0]))


def test_only_a_bounded_source_has_an_end_near_by() -> None:
    assert spans_tai_s(circular()) == ((-np.inf, np.inf),)
    [(first, last)] = spans_tai_s(iss())  # of SGP4: to where its drag has brought the ISS down
    assert first < START - 1000 * DAY_S
    assert last > START + 1000 * DAY_S


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda r, v: (r * 1e3, v * 1e3),
            r"on the state is not on an orbit around the Earth: .* are units \(km, km/s\)",
        ),
        (lambda r, v: (r / 2, v), "not on an orbit around the Earth"),
        (lambda r, v: (r, v * 1.5), "not on an orbit around the Earth"),
        (lambda r, v: (r, v * 1.01), "position and velocity do not follow from each other, by 4"),
        (lambda r, v: (r, np.roll(v, 1, axis=0)), "do not follow from each other"),
        (lambda r, v: (np.vstack([r[:5], r[5:6] + 1e4, r[6:]]), v), "from 2022-02-11T20:04:00.000Z on position"),
    ],
)
def test_states_that_are_no_orbit_are_refused_with_the_reason(change, said: str) -> None:
    tai_s, r_m, v_m_s = states(600.0)
    with pytest.raises(ElementsError, match=said) as error:
        source(kvn((tai_s, *change(r_m, v_m_s))))
    assert str(error.value).startswith("x.oem, line 6: ISS")


@pytest.mark.parametrize("step_s", [1.0, 60.0, 240.0])
def test_a_wrong_frame_is_refused_where_it_can_be_told(step_s: float) -> None:
    teme = states(1200.0, step_s)
    with pytest.raises(ElementsError, match=r"by 1.\d (m/s2|km in 240 s): is REF_FRAME \(ITRF\) right"):
        source(kvn(teme, REF_FRAME="ITRF"))
    tai_s, r_m, v_m_s = from_teme(teme, "ITRF")
    with pytest.raises(ElementsError, match=r"is REF_FRAME \(EME2000\) right"):
        source(kvn((tai_s, r_m, v_m_s), REF_FRAME="EME2000"))
    inertial_m_s = v_m_s + np.cross([0.0, 0.0, EARTH_RATE_RAD_S], r_m)
    with pytest.raises(ElementsError, match=r"is REF_FRAME \(ITRF\) right"):
        source(kvn((tai_s, r_m, inertial_m_s), REF_FRAME="ITRF"))


def test_a_reboost_inside_a_segment_is_taken() -> None:
    """2 m/s along the track, 10 s after a state; the relative motion by Clohessy and Wiltshire."""
    n, burnt_s, gain_m_s = 15.5 * 2 * np.pi / DAY_S, START + 610.0, 2.0

    def boosted_m(tai_s: Array) -> Array:
        r_m, v_m_s = iss().states_teme(tai_s)
        up = r_m / np.linalg.norm(r_m, axis=1)[:, None]
        along = v_m_s - np.sum(v_m_s * up, axis=1)[:, None] * up
        along /= np.linalg.norm(along, axis=1)[:, None]
        since = np.maximum(tai_s - burnt_s, 0.0)[:, None]
        rise_m, lead_m = 2 / n * (1 - np.cos(n * since)), 4 / n * np.sin(n * since) - 3 * since
        return r_m + gain_m_s * (rise_m * up + lead_m * along)

    tai_s = START + np.arange(0.0, 3601.0, 60.0)
    v_m_s = boosted_m(tai_s + 0.5) - boosted_m(tai_s - 0.5)
    oem = source(kvn((tai_s, boosted_m(tai_s), v_m_s)))
    fine = START + np.arange(0.0, 3600.0, 7.0)
    assert worst_m(oem.states_teme(fine)[0] - boosted_m(fine)) < 100.0  # near the burn; nothing is lost elsewhere
    assert worst_m(oem.states_teme(fine[150:])[0] - boosted_m(fine[150:])) < ASKED_M


def test_states_too_far_apart_are_refused() -> None:
    with pytest.raises(ElementsError, match="states 1200 s apart are too far apart"):
        source(kvn(states(7200.0, 1200.0)))


def test_it_is_picklable_with_its_correction() -> None:
    oem = source(kvn(states())).corrected(Correction(1e-4, 2e-4, 1e-9, 1e-5, 2e-5, 3e-5))
    again = pickle.loads(pickle.dumps(oem))
    tai_s = START + np.arange(0.0, 7200.0, 333.0)
    assert (again.kind, again.epoch_tai_s, again.correction) == ("oem", START, oem.correction)
    assert np.array_equal(again.states_teme(tai_s)[0], oem.states_teme(tai_s)[0])


STEPS = {
    "delta_raan_rad": 1e-3,
    "delta_mean_anomaly_rad": 1e-2,
    "delta_mean_motion_rad_s": 1e-7,
    "delta_e_cos_argp": 5e-4,
    "delta_e_sin_argp": 5e-4,
    "delta_inclination_rad": 1e-3,
}


@pytest.mark.parametrize("key", STEPS)
def test_each_correction_moves_the_orbit_as_it_moves_mean_elements(key: str) -> None:
    """Against SGP4, corrected by the same at the same epoch: at most 3 % of the move differs."""
    oem, sgp4 = source(kvn(states())), iss()
    correction = Correction(**{key: STEPS[key]})
    tai_s = START + np.arange(600.0, 6600.0, 60.0)
    moved_m = oem.corrected(correction).states_teme(tai_s)[0] - oem.states_teme(tai_s)[0]
    wanted_m = sgp4.corrected(correction).states_teme(tai_s)[0] - sgp4.states_teme(tai_s)[0]
    assert worst_m(wanted_m) > 2000.0
    assert worst_m(moved_m - wanted_m) < 0.03 * worst_m(wanted_m)


def test_a_correction_is_absolute_and_none_gives_the_ephemeris_itself() -> None:
    oem = source(kvn(states()))
    tai_s = START + np.arange(0.0, 7200.0, 333.0)
    twice = oem.corrected(Correction(0.1)).corrected(Correction(0.0, 0.01))
    assert np.array_equal(twice.states_teme(tai_s)[0], oem.corrected(Correction(0.0, 0.01)).states_teme(tai_s)[0])
    assert np.array_equal(twice.corrected(Correction()).states_teme(tai_s)[0], oem.states_teme(tai_s)[0])


def test_velocities_of_a_corrected_orbit_are_the_derivatives_of_its_positions() -> None:
    oem = source(kvn(states())).corrected(Correction(1e-3, 5e-3, 1e-8, 2e-4, -3e-4, 4e-4))
    tai_s = START + np.arange(600.0, 6600.0, 60.0)
    slope = (oem.states_teme(tai_s + 1.0)[0] - oem.states_teme(tai_s - 1.0)[0]) / 2.0
    assert worst_m(slope - oem.states_teme(tai_s)[1]) < 0.02


@pytest.mark.parametrize("shift_s", [-30.0, 30.0])
def test_a_shift_beyond_the_span_goes_on_smoothly(shift_s: float) -> None:
    oem, mean_motion = source(kvn(states())), 15.5 * 2 * np.pi / DAY_S
    tai_s = START + np.array([0.0, 7200.0])
    moved_m, _ = oem.corrected(Correction(delta_mean_anomaly_rad=shift_s * mean_motion)).states_teme(tai_s)
    assert worst_m(moved_m - iss().states_teme(tai_s + shift_s)[0]) < 1000.0  # of 230 km: the rates' difference


def test_a_correction_to_no_ellipse_is_an_orbit_error() -> None:
    with pytest.raises(OrbitError, match=r"ISS .* no ellipse"):
        source(kvn(states())).corrected(Correction(delta_e_cos_argp=1.2)).states_teme(np.array([START]))


def test_passes_near_the_ends_of_the_span_are_found_and_cut_there() -> None:
    whole = find_passes(iss(), SITE, START - DAY_S, START + DAY_S, 5.0)
    around = next(one for one in whole if one.rise_tai_s > START)
    middle = round(around.culmination_tai_s)
    for start, end in ((middle, middle + 7200), (middle - 7200, middle)):
        oem = source(kvn(states(float(end - start), start_tai_s=float(start))))
        wanted = [one for one in whole if one.set_tai_s > start and one.rise_tai_s < end]
        found = find_passes(oem, SITE, START - DAY_S, START + DAY_S, 5.0)
        assert len(found) == len(wanted) > 0
        for one, other in zip(found, wanted, strict=True):
            assert one.rise_tai_s == pytest.approx(max(other.rise_tai_s, start), abs=0.01)
            assert one.set_tai_s == pytest.approx(min(other.set_tai_s, end), abs=0.01)
    # searched from within the pass, its true begin is in the file or the file's own
    assert find_passes(oem, SITE, middle - 100.0, middle + DAY_S, 5.0)[0].rise_tai_s == pytest.approx(
        around.rise_tai_s, abs=0.01
    )
    assert find_passes(oem, SITE, middle + 1.0, middle + DAY_S, 5.0) == []


def test_passes_on_both_sides_of_a_gap_are_found() -> None:
    oem = source(kvn(states(DAY_S / 2), states(DAY_S / 2, start_tai_s=START + DAY_S / 2 + 600.0)))
    found = find_passes(oem, SITE, START, START + DAY_S, 5.0)
    wanted = find_passes(iss(), SITE, START, START + DAY_S, 5.0)
    assert [one.rise_tai_s for one in found] == pytest.approx([one.rise_tai_s for one in wanted], abs=0.01)


@pytest.mark.parametrize("estimator", ["circular", "deterministic", "kalman", "full"])
@pytest.mark.parametrize("late_s", [-2.0, 5.0])
def test_estimators_recover_an_error_along_the_track_and_of_the_node(estimator: str, late_s: float) -> None:
    tai_s, r_m, v_m_s = states(4 * 3600.0)
    late = source(kvn((tai_s + late_s, r_m, v_m_s))).corrected(Correction(2e-4))
    errors = source(kvn((tai_s + late_s, *late.states_teme(tai_s + late_s))))
    coming = find_passes(iss(), SITE, START + 600.0, START + 3 * 3600.0, 10.0)[0]
    times = np.arange(coming.rise_tai_s, coming.set_tai_s, 0.5)
    sky = look_at(iss(), times, SITE)
    readings = noisy(sky.az_deg, sky.el_deg, times, SIGMA_DEG, np.random.default_rng(3))
    half = times.size // 2
    fitter = make_estimator(estimator, errors, SITE, EstimatorSettings(SIGMA_DEG, SIGMA_DEG))
    fitter.add(Readings(times[:half], readings.az_deg[:half], readings.el_deg[:half]))
    fit = fitter.fit()
    assert fit is not None
    assert -fit.along_s == pytest.approx(late_s, abs=0.3)
    seen = look_at(errors.corrected(fit.correction), times[half:], SITE)
    off_deg = sky_angles_deg(seen.az_deg, seen.el_deg, sky.az_deg[half:], sky.el_deg[half:])
    assert off_deg.max() < (0.04 if estimator in ("kalman", "full") else 0.2)


def truth_itrs(real: RealPass, range_m: Array) -> States:
    """Earth-fixed states a minute apart from directions and ranges at 1 Hz; quartics over 41 s smooth the rounding."""
    r_m = (range_m[:, None] * real.unit_enu) @ enu_from_itrs(real.site.station) + station_itrs_m(real.site.station)
    seconds = np.arange(-20.0, 21.0)
    rows = []
    for k in range(20, real.tai_s.size - 20, 60):
        fitted = np.polynomial.polynomial.polyfit(seconds, r_m[k - 20 : k + 21], 4)
        rows.append((fitted[0], fitted[1]))
    r, v = np.array(rows).transpose(1, 0, 2)
    return real.tai_s[20:-20:60][: len(rows)], r, v


@needs_data
@pytest.mark.parametrize("name", real_passes.names())
def test_a_real_pass_as_an_ephemeris_gives_the_real_angles(name: str) -> None:
    real = real_passes.load(name)
    range_km = np.loadtxt(real.tle_path.with_suffix(".truth.csv"), delimiter=",", skiprows=1, usecols=3)
    minutes = truth_itrs(real, range_km * 1e3)
    oem = source(kvn(minutes, REF_FRAME="ITRF2014"), real.site.orientation)
    tai_s = np.arange(minutes[0][0], minutes[0][-1], 1.0)
    seen = look_at(oem, tai_s, real.site)
    assert sky_angles_deg(seen.az_deg, seen.el_deg, *real.sky(tai_s)).max() < 5e-5  # 1 m at 1200 km
    assert osculating_from_state(*oem.states_teme(tai_s[:1])).e[0] < 0.01

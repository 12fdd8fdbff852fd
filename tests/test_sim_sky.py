"""The simulated sky: truth files, orbits of their own, horizon, span, errors."""

from math import cos, radians
from pathlib import Path

import numpy as np
import pytest
from conftest import DATA, needs_data
from fake_sky import AZIMUTH, ELEVATION, START_TAI_S
from made_oems import START, iss, kvn, source, states
from made_orbits import EPOCH_TAI_S, circular, site

from acu_daemon.errors import UsageError
from acu_daemon.model import Correction, Site, Station, sky_angle_deg
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.sim.build import build_fake_acu, make_sky
from acu_daemon.sim.scenario import Scenario, SkyErrors
from acu_daemon.sim.sky import DirectionTable, OrbitSky, read_truth
from acu_daemon.units import DAY_S

INTERPOLATION_DEG = 1e-4
SITE = Site(Station("Huntsville", 34.73, -86.58, 190.0))
HEADER = "utc,az_deg,el_deg,range_km\n"


def line(second: float, az_deg: float = 10.0, el_deg: float = 20.0) -> str:
    return f"{utc_text(START_TAI_S + second)},{az_deg},{el_deg},1000.0\n"


@needs_data
@pytest.mark.parametrize("name", ["jason-1-Cuiaba-20030108T1414", "iss-2022-Huntsville-20220211T2156"])
def test_a_truth_file_thinned_to_every_second_line_gives_the_lines_left_out(name: str, tmp_path: Path) -> None:
    lines = (DATA / "passes" / f"{name}.truth.csv").read_text().splitlines(keepends=True)
    thin = tmp_path / "thin.csv"
    thin.write_text("".join([lines[0], *lines[1::2]]))
    full, sky = read_truth(DATA / "passes" / f"{name}.truth.csv"), read_truth(thin)
    for tai_s in np.arange(full.start_tai_s + 1.0, full.end_tai_s - 2.0, 1.0):
        expected, got = full.direction(float(tai_s)), sky.direction(float(tai_s))
        assert expected is not None
        assert got is not None
        assert sky_angle_deg(*expected[:2], *got[:2]) < INTERPOLATION_DEG


@needs_data
def test_between_lines_near_the_zenith_the_azimuth_is_not_linear() -> None:
    """Linear azimuth is wrong by 0.06 deg on the sky at the zenith."""
    sky = read_truth(DATA / "passes" / "jason-1-Cuiaba-20030108T1414.truth.csv")
    times = [sky.start_tai_s + k for k in range(int(sky.end_tai_s - sky.start_tai_s))]
    looks = [sky.direction(t) for t in times]
    top = max(range(len(looks)), key=lambda i: looks[i][1] if looks[i] else 0.0)  # type: ignore[index]
    a, b, middle = looks[top - 1], looks[top], sky.direction(times[top] - 0.5)
    assert a is not None
    assert b is not None
    assert middle is not None
    linear_az_deg = a[0] + ((b[0] - a[0] + 180) % 360 - 180) / 2
    wrong_deg = abs((middle[0] - linear_az_deg + 180) % 360 - 180) * cos(radians(middle[1]))
    assert 0.01 < wrong_deg < 0.2


def test_a_truth_file_has_no_signal_outside_its_span_and_below_the_horizon(tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    path.write_text(HEADER + "".join(line(k, 10.0, 3.0 - k) for k in range(7)))
    sky = read_truth(path)
    assert sky.direction(START_TAI_S - 0.1) is None
    assert sky.direction(START_TAI_S + 6.1) is None
    assert sky.direction(START_TAI_S) == pytest.approx((10.0, 3.0, 1e6))
    assert sky.direction(START_TAI_S + 2.5) == pytest.approx((10.0, 0.5, 1e6))
    assert sky.direction(START_TAI_S + 3.5) is None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("utc,az,el,range\n", "line 1: header 'utc,az,el,range', expected 'utc,az_deg,el_deg,range_km'"),
        (HEADER + line(0) + line(0), "line 3: the times must rise"),
        (HEADER + line(0) + "2018-06-15T18:27:00,1,2,3\n", "line 3: "),
        (HEADER + line(0) + line(1).replace("20.0", "x"), "line 3: "),
        (HEADER + line(0) + line(1).replace("20.0", "nan"), "line 3: every number must be finite"),
        (HEADER + line(0) + line(1) + "1,2\n", "line 4: "),
        (HEADER + line(0) + line(1) + line(2), "3 lines of data, at least 4"),
    ],
)
def test_a_truth_file_that_cannot_be_used_names_its_line(text: str, expected: str, tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    path.write_text(text)
    with pytest.raises(UsageError, match=expected):
        read_truth(path)


def test_a_truth_file_that_is_not_there_is_wrong_use(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"--truth .*none\.csv: No such file or directory"):
        read_truth(tmp_path / "none.csv")


def test_an_orbit_sky_agrees_with_the_look_angles() -> None:
    propagator, here = circular(), site()
    sky = OrbitSky(propagator, here)
    times = EPOCH_TAI_S + np.arange(0.0, 7000.0, 7.3)
    look = look_at(propagator, times, here)
    visible_count = 0
    for tai_s, az_deg, el_deg in zip(times, look.az_deg, look.el_deg, strict=True):
        direction = sky.direction(float(tai_s))
        assert (direction is not None) == (el_deg >= 0.0)
        if direction is not None:
            visible_count += 1
            assert sky_angle_deg(az_deg, el_deg, *direction[:2]) < INTERPOLATION_DEG
    assert visible_count > 20


@pytest.mark.parametrize("late_s", [0.0, 7.0, -7.0])
def test_the_sky_of_an_ephemeris_ends_with_it(late_s: float) -> None:
    around = find_passes(iss(), SITE, START + 600.0, START + DAY_S, 5.0)[0]
    begin, end = around.culmination_tai_s - 30.3, around.culmination_tai_s + 30.9
    oem = source(kvn(states(end - begin, 20.4, begin)))
    sky = make_sky(oem, SITE, Scenario(sky=SkyErrors(along_track_s=late_s)))
    for away_s in (-100.0, -1e-3, end - begin + 1e-3, 1000.0):
        assert sky.direction(begin + late_s + away_s) is None
    for tai_s in np.linspace(begin + late_s, end + late_s, 500)[1:-1]:
        seen, wanted = sky.direction(float(tai_s)), look_at(iss(), np.array([tai_s - late_s]), SITE)
        assert seen is not None
        if late_s == 0.0:
            assert sky_angle_deg(*seen[:2], wanted.az_deg[0], wanted.el_deg[0]) < INTERPOLATION_DEG


def test_a_satellite_that_runs_late_is_where_the_elements_had_it_before() -> None:
    propagator, here = circular(), site()
    late = make_sky(propagator, here, Scenario(sky=SkyErrors(along_track_s=3.0)))
    r_late, _ = late._propagator.states_teme(np.array([EPOCH_TAI_S + 103.0]))  # type: ignore[attr-defined]
    r, _ = propagator.states_teme(np.array([EPOCH_TAI_S + 100.0]))
    assert r_late == pytest.approx(r)
    assert late._propagator.kind == propagator.kind  # type: ignore[attr-defined]


def test_a_turned_node_is_the_correction_of_the_elements() -> None:
    propagator, here = circular(), site()
    turned = make_sky(propagator, here, Scenario(sky=SkyErrors(delta_raan_deg=0.1)))
    expected = OrbitSky(propagator.corrected(Correction(delta_raan_rad=radians(0.1))), here)
    times = [EPOCH_TAI_S + k for k in range(0, 7000, 50)]
    assert [turned.direction(t) for t in times] == [expected.direction(t) for t in times]


def test_a_fake_acu_is_built_from_files(tmp_path: Path) -> None:
    scenario, truth = tmp_path / "s.toml", tmp_path / "t.csv"
    scenario.write_text("[acu]\nhas_tilt = true\n")
    truth.write_text(HEADER + "".join(line(k) for k in range(5)))
    acu = build_fake_acu(
        azimuth=AZIMUTH,
        elevation=ELEVATION,
        beamwidth_deg=1.0,
        propagator=circular(),
        site=site(),
        start_tai_s=START_TAI_S,
        scenario=scenario,
        truth=truth,
        address=0x32,
    )
    assert acu.address == 0x32
    assert acu.status().is_tilt_fitted
    assert isinstance(acu.parts.sky, DirectionTable)

"""The simulated sky in its air, and the pedestal that looks at it: what is apparent, what the encoders then read."""

from math import cos, radians
from pathlib import Path

import numpy as np
import pytest
from conftest import DATA, needs_data
from fake_sky import START_TAI_S, Bench, Star
from flights import demo_target, sky_of

from acu_daemon.acu.commands import AcuMode, SelectMode
from acu_daemon.cli.simulated import station_air
from acu_daemon.config.antenna_tables import AtmosphereSection
from acu_daemon.model import sky_angle_deg
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.pointing.air import Air
from acu_daemon.sim.apparent_sky import ApparentSky, make_air
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.sim.scenario import AcuChoice, AirChoice, Drift, Encoder, Scenario, SkyErrors
from acu_daemon.sim.shell_air import simulated_air
from acu_daemon.sim.sky import read_truth

WEATHER = Air(1000.0, 20.0, 70.0)
MOUNT = MountAxes(0.05, -0.04, 0.02, 0.015, -0.02, 0.01, 0.03)
SERVO_DEG = 0.01  # what the autotrack loop of a moving star leaves


def truth(tmp_path: Path, lines: list[tuple[float, float, float]]) -> Path:
    path = tmp_path / "truth.csv"
    rows = "".join(f"{utc_text(START_TAI_S + t)},{az},{el},1200.0\n" for t, az, el in lines)
    path.write_text("utc,az_deg,el_deg,range_km\n" + rows)
    return path


def made(scenario: Scenario, station_air: Air | None, path: Path | None = None):  # type: ignore[no-untyped-def]
    target = demo_target()
    return make_sky(target.elements.propagator, target.station.site, scenario, path, station_air=station_air)


def test_a_truth_file_stays_geometric_and_its_satellite_rises_earlier_in_air(tmp_path: Path) -> None:
    path = truth(tmp_path, [(t, 40.0, -2.0 + 0.05 * t) for t in np.arange(0.0, 200.0, 5.0)])
    in_vacuum, in_air = made(Scenario(), None, path), made(Scenario(air=AirChoice()), WEATHER, path)
    air = simulated_air(1000.0, 20.0, 70.0, demo_target().station.site.station.height_m)
    assert in_vacuum.direction(START_TAI_S + 39.0) is None
    assert in_air.direction(START_TAI_S + 20.0) is None  # at -1 deg
    risen = in_air.direction(START_TAI_S + 30.0)  # at -0.5 deg
    assert risen is not None
    late_deg = 0.05 * 1.2e6 / 299792458.0  # the signal is of then, as the daemon has it
    assert risen[1] == pytest.approx(air.apparent_el_deg(-0.5 - late_deg, 1.2e6), abs=1e-6)
    later_vacuum, later = in_vacuum.direction(START_TAI_S + 140.0), in_air.direction(START_TAI_S + 140.0)
    assert later_vacuum == pytest.approx((40.0, 5.0, 1.2e6), abs=1e-6)
    assert later is not None
    assert later[1] - 5.0 == pytest.approx(0.19, abs=0.03)
    assert later[0] == pytest.approx(40.0)


def test_without_refraction_there_is_no_air_whatever_the_scenario_says(tmp_path: Path) -> None:
    path = truth(tmp_path, [(t, 40.0, 5.0) for t in np.arange(0.0, 50.0, 5.0)])
    for scenario in (Scenario(), Scenario(air=AirChoice())):
        seen = made(scenario, None, path).direction(START_TAI_S + 20.0)
        assert seen == pytest.approx((40.0, 5.0, 1.2e6), abs=1e-6)


def test_a_scenario_that_says_nothing_of_the_air_has_it_within_10_percent_of_what_is_told(tmp_path: Path) -> None:
    path = truth(tmp_path, [(t, 40.0, 5.0) for t in np.arange(0.0, 50.0, 5.0)])

    def raised_deg(scenario: Scenario, seed: int = 0) -> float:
        target = demo_target()
        source, site = target.elements.propagator, target.station.site
        sky = make_sky(source, site, scenario, path, station_air=WEATHER, seed=seed)
        seen = sky.direction(START_TAI_S + 20.0)
        assert seen is not None
        return seen[1] - 5.0

    as_told = raised_deg(Scenario(air=AirChoice()))
    drawn = [raised_deg(Scenario(), seed) / as_told for seed in range(20)]
    assert 0.88 < min(drawn) < 0.95
    assert 1.05 < max(drawn) < 1.12


def test_the_stations_file_tells_the_weather_or_that_there_is_none() -> None:
    target = demo_target(atmosphere={"pressure_hpa": 980.0})
    found = station_air(target.station)
    assert found is not None
    assert found.pressure_hpa == 980.0
    assert 15.0 < found.temperature_c < 30.0  # the tropics' standard
    assert station_air(demo_target(atmosphere={"refraction": False}).station) is None
    assert AtmosphereSection().air(target.station.site.station).pressure_hpa == pytest.approx(982.0, abs=5.0)


def test_a_scenario_has_its_own_weather_and_one_drawn_by_the_seed() -> None:
    def lifted_deg(chosen: AirChoice, seed: int = 0) -> float:
        return make_air(WEATHER, chosen, 0.0, seed).apparent_el_deg(5.0, 1e6) - 5.0

    told = lifted_deg(AirChoice())
    assert lifted_deg(AirChoice(refractivity_factor=1.08)) == pytest.approx(1.08 * told, rel=0.005)
    assert lifted_deg(AirChoice(humidity_percent=0.0)) < 0.9 * told
    assert lifted_deg(AirChoice(profile="exponential")) == pytest.approx(told, rel=0.02)
    assert lifted_deg(AirChoice(profile="exponential")) != told
    drawn = [lifted_deg(AirChoice(refractivity_drawn_within=0.1), seed) for seed in (0, 0, 1)]
    assert drawn[0] == drawn[1] != drawn[2]


@needs_data
def test_light_time_shows_a_real_pass_where_it_was() -> None:
    path = next((DATA / "passes").glob("jason-1-*.truth.csv"))
    geometric = read_truth(path)
    late = ApparentSky(geometric, is_late=True)
    off_deg = []
    for tai_s in np.arange(geometric.start_tai_s + 1.0, geometric.end_tai_s - 1.0, 5.0):
        at, seen = geometric.direction(float(tai_s)), late.direction(float(tai_s))
        if at is not None and seen is not None:
            off_deg.append(sky_angle_deg(*at[:2], *seen[:2]))
            then = geometric.direction(float(tai_s) - at[2] / 299792458.0)
            assert then == seen
    assert 1e-3 < max(off_deg) < 1.5e-3


def test_the_encoders_on_a_satellite_read_what_the_pedestals_rotations_give() -> None:
    scenario = Scenario(
        acu=AcuChoice(azimuth_deg=200.0, elevation_deg=30.0, mode="remote"),
        encoder=Encoder(azimuth_bias_deg=0.1),
        mount=MOUNT,
    )
    bench = Bench(ApparentSky(Star(200.0, 30.0), simulated_air(1000.0, 20.0, 70.0)), scenario)
    bench.acu.answer(SelectMode(AcuMode.AUTOTRACK))
    bench.wait(20.0)
    row = bench.acu.trace_row()
    apparent = bench.sky.direction(bench.tai_s)
    assert apparent is not None
    assert row.satellite_el_deg == apparent[1] > 30.02
    encoder_az_deg, encoder_el_deg = MOUNT.encoders_deg(200.0, apparent[1])
    assert row.beam_error_deg == pytest.approx(0.0, abs=1e-4)
    assert row.encoder_az_deg == pytest.approx(encoder_az_deg + 0.1, abs=1e-4)
    assert row.encoder_el_deg == pytest.approx(encoder_el_deg, abs=1e-4)
    assert sky_angle_deg(row.boresight_az_deg, row.boresight_el_deg, 200.0, apparent[1]) < 1e-4


def test_the_encoders_drift_from_day_to_night() -> None:
    drift = Drift(azimuth_deg=0.02, elevation_deg=-0.01, peak_utc_h=15.0)
    at = {hour: drift.at(tai_from_utc(f"2026-03-01T{hour:02d}:00:00Z")) for hour in (3, 9, 15, 21)}
    assert at[15] == pytest.approx((0.02, -0.01), abs=1e-9)
    assert at[3] == pytest.approx((-0.02, 0.01), abs=1e-9)
    assert at[9] == pytest.approx((0.0, 0.0), abs=1e-9)
    scenario = Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0), drift=Drift(azimuth_deg=0.02))
    bench = Bench(Star(), scenario)
    bench.wait(1.0)
    row, share = bench.acu.trace_row(), Drift(azimuth_deg=1.0).at(bench.tai_s)[0]
    assert row.boresight_az_deg == pytest.approx(30.0 - 0.02 * share, abs=1e-6)
    assert row.beam_error_deg == pytest.approx(abs(0.02 * share) * cos(radians(40.0)), abs=1e-5)


def test_without_air_mount_and_light_time_the_sky_is_the_geometric_one() -> None:
    target = demo_target(atmosphere={"refraction": False})
    usual = made(Scenario(sky=SkyErrors(0.9, 0.015)), station_air(target.station))
    assert not isinstance(usual, ApparentSky)
    assert type(usual) is type(sky_of(target))
    assert isinstance(sky_of(demo_target()), ApparentSky)


def test_the_signal_is_late_where_there_is_air_and_a_vacuum_is_that_of_truth_files() -> None:
    """For the simulator as for the daemon, unless the scenario says otherwise of the simulator."""
    for has_air in (True, False):
        target = demo_target(atmosphere={"refraction": has_air})
        assert target.station.site.has_light_time is has_air
        for chosen, is_late in ((None, has_air), (True, True), (False, False)):
            sky = made(Scenario(sky=SkyErrors(light_time=chosen)), station_air(target.station))
            assert (isinstance(sky, ApparentSky) and sky.is_late) is is_late

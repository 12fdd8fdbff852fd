"""Whether readings can be a satellite's: its own, late, aged or manoeuvred, are; another's are told."""

from dataclasses import replace

import numpy as np
import pytest
import real_passes
from conftest import DATA, needs_data
from made_orbits import circular, site, visible
from real_passes import RealPass, noisy

from acu_daemon.assist.screening.another_satellite import needed, why_not_this_satellite
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Correction, Readings
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle

SETTINGS = EstimatorSettings()
NOISE_DEG = 0.03


def own(name: str) -> tuple[RealPass, ElementSet]:
    real = real_passes.load(name)
    (elements, *_), _ = parse_tle(real.tle_path.read_text(), real.tle_path.name)
    return real, elements


def seen(real: RealPass, late_s: float = 0.0, part: float = 1.0) -> Readings:
    tai_s = np.arange(real.tai_s[5], real.tai_s[0] + part * np.ptp(real.tai_s), 2.0)
    readings = noisy(*real.sky(tai_s), tai_s, NOISE_DEG, np.random.default_rng(3))
    return replace(readings, tai_s=tai_s + late_s)


def why(elements: ElementSet, real: RealPass, readings: Readings) -> str:
    return why_not_this_satellite(Sgp4Propagator(elements), real.site, SETTINGS, readings)


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("name", real_passes.names())
@pytest.mark.parametrize("late_s", [0.0, 60.0, -60.0])
def test_a_real_pass_on_its_own_elements_is_never_told_as_another_also_by_a_clock_a_minute_off(
    name: str, late_s: float
) -> None:
    real, elements = own(name)
    for part in (0.2, 1.0):
        assert why(elements, real, seen(real, late_s, part)) == ""


@pytest.mark.parametrize("late_s", [-300.0, -90.0, 90.0, 300.0])
def test_a_clock_that_is_off_either_way_takes_no_manoeuvre(late_s: float) -> None:
    """The Earth has turned on meanwhile: that is no change of the node."""
    source, where = circular(66.0), site(4.0)
    tai_s = visible(source, where, 4.0)
    look = look_at(source, tai_s, where)
    readings = noisy(look.az_deg, look.el_deg, tai_s, 0.01, np.random.default_rng(3))
    takes = needed(source, where, SETTINGS, replace(readings, tai_s=tai_s + late_s))
    assert takes is not None
    assert takes.along_s == pytest.approx(late_s, rel=0.05)
    assert takes.manoeuvres < 0.5
    assert takes.near_share == 1.0


@needs_data
@pytest.mark.parametrize(
    ("name", "older"),
    [
        ("jason-2-Huntsville-20080903T1356", "jason-2-Svalbard-20080830T2135"),
        ("sentinel-3a-Tsukuba-20181228T1047", "sentinel-3a-CachoeiraPaulista-20181225T0140"),
        ("topex-Huntsville-19971213T2336", "topex-Cuiaba-19971211T0851"),
    ],
)
def test_elements_of_days_before_are_still_its_own(name: str, older: str) -> None:
    real, _ = own(name)
    assert why(own(older)[1], real, seen(real)) == ""


@needs_data
@pytest.mark.parametrize("m_s", [10.0, -10.0])
def test_after_a_manoeuvre_a_revolution_before_it_is_still_itself(m_s: float) -> None:
    """Along the track: the rate changes by 3 dv/v, and so what it is ahead of the elements (Gauss)."""
    real, elements = own("jason-3-Wallops-20180615T1827")
    source = Sgp4Propagator(elements)
    change = -3.0 * m_s / 7500.0 * elements.mean_motion_rad_s
    gained = change * (float(real.tai_s[0]) - 6000.0 - elements.epoch_tai_s)
    moved = source.corrected(Correction(delta_mean_motion_rad_s=change, delta_mean_anomaly_rad=-gained))
    look = look_at(moved, real.tai_s, real.site)
    up = look.el_deg > 3.0
    readings = noisy(look.az_deg[up], look.el_deg[up], real.tai_s[up], NOISE_DEG, np.random.default_rng(1))
    takes = needed(source, real.site, SETTINGS, readings)
    assert takes is not None
    assert abs(takes.along_s) > 20.0
    assert why(elements, real, readings) == ""


@needs_data
@pytest.mark.parametrize("name", ["sentinel-3a-Svalbard-20181226T1154", "iss-2022-Huntsville-20220211T2156"])
def test_other_satellites_of_a_public_list_are_told_as_that(name: str) -> None:
    real, elements = own(name)
    others, _ = parse_tle((DATA / "tle_sets" / "celestrak_weather_2026-05-30.txt").read_text(), "others")
    low = [one for one in others if one.mean_motion_rad_s > 2.0 * np.pi / 7200.0][:20]
    assert len(low) == 20
    readings = seen(real)
    assert [one.label for one in low if not why(replace(one, epoch_tai_s=elements.epoch_tai_s), real, readings)] == []


@needs_data
def test_a_few_seconds_of_readings_tell_nothing() -> None:
    real, elements = own("jason-3-Wallops-20180615T1827")
    assert needed(Sgp4Propagator(elements), real.site, SETTINGS, seen(real).part(slice(0, 12))) is None

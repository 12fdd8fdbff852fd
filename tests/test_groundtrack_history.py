"""D and manoeuvres from element sets: made ones, whose truth is known; and files that nothing can be seen in."""

import gzip
import json
from dataclasses import replace
from functools import lru_cache
from math import radians
from pathlib import Path

import numpy as np
import pytest
from command_line import acu_daemon
from conftest import DATA, needs_data
from groundtrack_world import CRAFT, NODE_RAD, world
from made_element_sets import element_set, noisy, omm_text

from acu_daemon.groundtrack.environment import EPOCH_TAI_S, Spacecraft, free_motion, node_rad
from acu_daemon.groundtrack.gps import Steering, TrueOrbit
from acu_daemon.groundtrack.history import mean_orbit_of, revolutions_per_day
from acu_daemon.groundtrack.reference import Cycle, ReferenceOrbit, phased, sun_synchronous
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DAY_S

DAYS = 90
MANOEUVRES = Steering(np.array([11.8, 43.1, 70.2]) * DAY_S, np.array([168.0, 190.0, 196.0]))  # keep it in +-4 km
NOISELESS_M, NOISY_M = 10.0, 130.0  # of D, rms
SIZE_SHARE = 0.03
KEPT_M = 8_000.0  # the widest band of such missions, Landsat's


@lru_cache
def orbit() -> TrueOrbit:
    return TrueOrbit(free_motion(CRAFT, DAYS + 1.0, world().flux), NODE_RAD)


@lru_cache
def made() -> list[ElementSet]:
    """A set a day."""
    times_s = (np.arange(DAYS) + 0.37) * DAY_S
    return [element_set(orbit(), MANOEUVRES, float(t)) for t in times_s]


def from_elements(path: Path, sets: list[ElementSet], *options: object) -> dict[str, object]:
    path.write_text(omm_text(sets))
    done = acu_daemon("groundtrack", "from-elements", path, "--json", *options)
    assert done.code == 0, done.err
    found: dict[str, object] = json.loads(done.out)
    return found


def error_m(found: dict[str, object]) -> float:
    """Rms of D against the truth, but for a constant."""
    points = found["d"]
    seen = np.array([one["d_m"] for one in points])  # type: ignore[attr-defined]
    times_s = np.array([tai_from_utc(one["utc"]) for one in points]) - EPOCH_TAI_S  # type: ignore[attr-defined]
    return float(np.std(seen - orbit().drift_m(times_s, MANOEUVRES)))


@pytest.mark.long
def test_d_of_made_sets_is_true_to_ten_metres_and_every_manoeuvre_is_found(tmp_path: Path) -> None:
    found = from_elements(tmp_path / "made.json", made())
    assert (found["cycle_revolutions"], found["cycle_days"]) == (373, 26)
    assert error_m(found) < NOISELESS_M
    seen = found["manoeuvres"]
    assert len(seen) == 3  # type: ignore[arg-type]
    for one, size_m in zip(seen, MANOEUVRES.delta_a_m, strict=True):  # type: ignore[call-overload]
        assert one["delta_a_m"] == pytest.approx(size_m, rel=SIZE_SHARE)


def test_noise_of_real_sets_leaves_d_and_the_large_manoeuvres_to_be_seen(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    found = from_elements(tmp_path / "made.json", [noisy(one, rng) for one in made()])
    assert error_m(found) < NOISY_M
    sizes = [one["delta_a_m"] for one in found["manoeuvres"]]  # type: ignore[attr-defined]
    assert 2 <= len(sizes) <= 3
    assert sizes[0] == pytest.approx(168.0, abs=25.0)


def test_without_manoeuvres_none_are_found(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    quiet = [noisy(one, rng) for one in made()[13:42]]  # between two
    assert from_elements(tmp_path / "made.json", quiet)["manoeuvres"] == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("reference", "ballistic_m2_kg", "day", "size_m"),
    [
        (sun_synchronous(Cycle(143, 10)), 0.012, 20.2, 28.0),  # as Sentinel-2
        (phased(Cycle(127, 10), 1e-4, radians(66.04)), 0.02, 30.0, 8.0),  # as Jason: not sun-synchronous, little drag
    ],
)
def test_other_phased_satellites_are_seen_with_their_cycle_and_manoeuvre(
    tmp_path: Path, reference: ReferenceOrbit, ballistic_m2_kg: float, day: float, size_m: float
) -> None:
    craft = Spacecraft(reference, ballistic_m2_kg)
    there = TrueOrbit(free_motion(craft, 51.0, world().flux), node_rad(craft, EPOCH_TAI_S))
    steering = Steering(np.array([day * DAY_S]), np.array([size_m]))
    sets = [element_set(there, steering, (k + 0.3) * DAY_S) for k in range(50)]
    found = from_elements(tmp_path / "made.json", sets)
    assert (found["cycle_revolutions"], found["cycle_days"]) == tuple(reference.cycle)
    (only,) = found["manoeuvres"]  # type: ignore[misc]
    assert only["delta_a_m"] == pytest.approx(size_m, abs=1.0)
    assert only["utc"].startswith(utc_text(EPOCH_TAI_S + day * DAY_S)[:10])


def test_a_table_and_files_are_written_for_people(tmp_path: Path) -> None:
    path = tmp_path / "made.json"
    path.write_text(omm_text(made()))
    csv, png = tmp_path / "d.csv", tmp_path / "d.png"
    done = acu_daemon("groundtrack", "from-elements", path, "--csv", csv, "--plot", png, "--cycle", "373/26")
    assert done.code == 0
    assert "3 manoeuvres found" in done.out
    assert csv.read_text().startswith("utc,d_m\n2010-01-01T")
    assert png.stat().st_size > 10_000


def test_a_gap_is_told_and_nothing_is_invented_in_it(tmp_path: Path) -> None:
    sets = made()
    path = tmp_path / "made.json"
    path.write_text(omm_text(sets[:21] + sets[40:]))
    done = acu_daemon("groundtrack", "from-elements", path, "--json")
    assert "warning: nothing is known from 2010-01-21" in done.err
    assert len(json.loads(done.out)["d"]) == len(sets) - 19


@pytest.mark.parametrize(
    ("change", "options", "said"),
    [
        (lambda sets: sets[:2], (), "too few to see a drift in"),
        (lambda sets: [replace(one, norad_id=90_001 + k % 2) for k, one in enumerate(sets)], (), "of 2 satellites"),
        (lambda sets: sets, ("--norad-id", 5), "no element set of 5; it holds 90001"),
        (lambda sets: sets, ("--cycle", "143/10"), "it is not its cycle"),
        (lambda sets: sets, ("--cycle", "143"), "expected REVOLUTIONS/DAYS"),
        (lambda sets: sets, ("--cycle", 2 * "9999999999" + "/16"), "expected REVOLUTIONS/DAYS"),
        (lambda sets: sets, ("--cycle", "99999/1"), "below the ground"),
        (lambda sets: sets, ("--plot", "d.foo"), "expected a name that ends in .png"),
        (lambda sets: [replace(one, inclination_rad=0.0) for one in sets], (), "does not cross the equator"),
        (lambda sets: sets, ("--csv", "/nowhere/d.csv"), "there is no directory"),
        (
            lambda sets: [
                replace(one, mean_motion_rad_s=one.mean_motion_rad_s * 1.00021, mean_anomaly_rad=0.7 * k % 6.28)
                for k, one in enumerate(sets)
            ],
            (),
            "no repeat cycle of up to 45 days fits",
        ),
    ],
)
def test_sets_in_which_no_ground_track_can_be_seen_are_refused(
    tmp_path: Path, change: object, options: tuple[object, ...], said: str
) -> None:
    path = tmp_path / "made.json"
    path.write_text(omm_text(change(made())))  # type: ignore[operator]
    done = acu_daemon("groundtrack", "from-elements", path, *options)
    assert done.code == 2
    assert said in done.err


def test_a_file_that_is_not_there_and_one_without_sets_are_told(tmp_path: Path) -> None:
    assert acu_daemon("groundtrack", "from-elements", tmp_path / "none.tle").code == 2
    (tmp_path / "empty.tle").write_text("")
    done = acu_daemon("groundtrack", "from-elements", tmp_path / "empty.tle")
    assert done.code == 2
    assert "no element set" in done.err


def test_sets_a_whole_cycle_apart_are_not_taken_for_a_shorter_cycle(tmp_path: Path) -> None:
    path = tmp_path / "made.json"
    path.write_text(omm_text(made()[::26]))
    done = acu_daemon("groundtrack", "from-elements", path, "--json")
    assert done.code == 0, done.err
    assert json.loads(done.out)["cycle_revolutions"] == 373
    assert "nothing is known from" in done.err


def test_a_set_of_another_orbit_under_the_same_number_is_left_out_with_a_word(tmp_path: Path) -> None:
    sets = made()
    sets = [*sets[:30], replace(sets[30], mean_motion_rad_s=1.02 * sets[30].mean_motion_rad_s), *sets[31:]]
    path = tmp_path / "made.json"
    path.write_text(omm_text(sets))
    done = acu_daemon("groundtrack", "from-elements", path, "--json")
    assert "record 31: left out: of quite another orbit" in done.err
    found = json.loads(done.out)
    assert len(found["d"]) == DAYS - 1
    assert len(found["manoeuvres"]) == 3


@pytest.mark.long
@needs_data
@pytest.mark.parametrize(("norad_id", "cycle"), [(39084, (233, 16)), (40697, (143, 10)), (41335, (385, 27))])
def test_over_gaps_of_years_a_real_satellite_is_where_its_mission_keeps_it(
    tmp_path: Path, norad_id: int, cycle: tuple[int, int]
) -> None:
    folder = DATA / "tle_sets"
    files = [folder / f"celestrak_resource_{day}.txt" for day in ("2018-11-07", "2026-05-30")]
    texts = [one.read_text() for one in files]
    texts += [gzip.decompress(one.read_bytes()).decode() for one in folder.glob("*.gz")]
    path = tmp_path / "history.tle"
    path.write_text("\n".join(texts))
    done = acu_daemon("groundtrack", "from-elements", path, "--norad-id", norad_id, "--json")
    assert done.code == 0, done.err
    assert done.err.count("nothing is known from") == 2
    found = json.loads(done.out)
    assert (found["cycle_revolutions"], found["cycle_days"]) == cycle
    assert found["d_max_m"] - found["d_min_m"] < KEPT_M


@needs_data
def test_the_mean_orbit_of_real_sets_is_that_of_their_published_cycles() -> None:
    sets, _ = parse_tle((DATA / "tle_sets" / "celestrak_resource_2026-05-30.txt").read_text(), "resource")
    published = {"LANDSAT 8": Cycle(233, 16), "SENTINEL-2A": Cycle(143, 10), "SENTINEL-2B": Cycle(143, 10)}
    for name, cycle in published.items():
        one = next(one for one in sets if one.name.startswith(name))
        mean = mean_orbit_of(one.mean_motion_rad_s, one.eccentricity, one.inclination_rad)
        assert revolutions_per_day(mean) == pytest.approx(cycle.per_day, abs=2e-4)

"""Which of several sources of a satellite's orbit is used for a pass: the one that is expected to be off the least."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import acu_daemon
from config_files import STATION, from_file, write
from evolved_sets import NEWER, PLAIN, later
from made_oems import ISS
from made_tables import cpf, earth_fixed

from acu_daemon.assist.estimators.full.carry_over import CarryOver, carry_over_of
from acu_daemon.assist.estimators.full.estimated_states import STATE_COUNT
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.config.load import load_satellite, load_station
from acu_daemon.edge import elements_store
from acu_daemon.edge.elements_choice import ElementsSources, LastFit, choose_elements
from acu_daemon.edge.elements_file import LoadedElements
from acu_daemon.edge.elements_store import (
    WantedSatellite,
    confirm_doubtful,
    doubtful_file,
    keep_set,
    read_sets,
    record_of,
    sets_file,
)
from acu_daemon.errors import ElementsError
from acu_daemon.model import Correction, FitResult
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.elements import ElementLimits
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S, DEG

URL = "https://example.org/group.json"
SOURCES = STATION + f'[elements]\nsource = ["{URL}", "given"]\n'
FROM_STATION = '[satellite]\nname = "ISS"\nnorad_id = 25544\n[elements]\nkind = "station"\n'
WANTED = WantedSatellite("ISS", 25544, ElementLimits())
NOW_TAI_S = NEWER.epoch_tai_s + 0.1 * DAY_S
REBOOSTED = replace(NEWER, mean_anomaly_rad=NEWER.mean_anomaly_rad + 2.0 * DEG)  # 240 km early


def config(directory: Path, satellite: str = FROM_STATION, station: str = SOURCES) -> Path:
    write(directory, station, iss=satellite)
    (directory / "given").mkdir(exist_ok=True)
    (directory / "elements").mkdir(exist_ok=True)
    return directory


def keep(directory: Path, *sets: ElementSet) -> None:
    for one in sets:
        keep_set(directory / "elements", WANTED, one, URL, NOW_TAI_S)


def choose(
    directory: Path, at_tai_s: float = NOW_TAI_S, carried: CarryOver | None = None, now_tai_s: float = NOW_TAI_S
) -> LoadedElements:
    base = load_station(directory)
    satellite, station = load_satellite(directory, "iss", base)
    fit = None if carried is None else LastFit(carried, station.site, EstimatorSettings())
    return choose_elements(
        satellite,
        directory / "satellites" / "iss.toml",
        now_tai_s,
        station.site.orientation,
        at_tai_s,
        ElementsSources.of(directory, base.elements),
        fit,
    )


def left(directory: Path, source: Propagator, at_tai_s: float, along_deg: float = 0.0) -> CarryOver:
    """What a pass leaves that has found the satellite so far along the track from where its elements have it."""
    sigma = np.zeros(STATE_COUNT)
    sigma[:6] = 2e-5, 2e-5, 2e-9, 1e-5, 1e-5, 1e-5
    sigma[6:10] = 1e-4
    fit = FitResult(
        estimator="full",
        correction=Correction(delta_mean_anomaly_rad=along_deg * DEG),
        at_tai_s=at_tai_s,
        reading_count=300,
        rejected_count=0,
        residual_rms_deg=0.03,
        along_s=0.0,
        across_deg=0.0,
        covariance=np.diag(sigma**2),
    )
    carried = carry_over_of(fit, source, load_station(directory).site)
    assert carried is not None
    return carried


def test_the_newest_of_what_is_kept_and_a_satellites_own_file_is_used_and_why_is_said(tmp_path: Path) -> None:
    own = from_file("ISS", "tle", "iss.tle", 25544)
    config(tmp_path, own)
    (tmp_path / "satellites" / "iss.tle").write_text(ISS)
    alone = choose(tmp_path)
    assert (alone.propagator.kind, alone.epoch_tai_s) == ("tle", pytest.approx(PLAIN.epoch_tai_s))
    keep(tmp_path, NEWER)
    chosen = choose(tmp_path)
    assert chosen.epoch_tai_s == pytest.approx(NEWER.epoch_tai_s, abs=1e-5)
    assert f"of 2 sources the one of {utc_text(NEWER.epoch_tai_s, 0)} is used (omm)" in chosen.choice
    assert "the next is " in chosen.choice
    before = choose(tmp_path, PLAIN.epoch_tai_s - 0.5 * DAY_S)
    assert before.propagator.kind == "tle"


def test_without_sources_all_is_as_it_was(tmp_path: Path) -> None:
    config(tmp_path, from_file("ISS", "tle", "iss.tle", 25544), STATION)
    (tmp_path / "satellites" / "iss.tle").write_text(ISS)
    keep(tmp_path, NEWER)
    assert choose(tmp_path).epoch_tai_s == pytest.approx(PLAIN.epoch_tai_s)
    config(tmp_path, FROM_STATION, STATION)
    with pytest.raises(ElementsError, match=r"kind = \"station\", but station.toml has no \[elements\] source"):
        choose(tmp_path)


def test_a_satellite_of_which_there_is_nothing_is_told_where_was_looked(tmp_path: Path) -> None:
    config(tmp_path)
    (tmp_path / "given" / "notes.txt").write_text("the elements come on Monday")
    with pytest.raises(ElementsError, match=r"no elements of norad_id 25544 in .*/elements and .*/given; `acu-daemon"):
        choose(tmp_path)


def test_a_satellite_of_the_stations_sources_needs_its_number(tmp_path: Path) -> None:
    config(tmp_path, FROM_STATION.replace("norad_id = 25544\n", ""))
    done = acu_daemon("passes", "--config", tmp_path, "--satellite", "iss")
    assert done.code == 2
    assert 'elements.kind = "station" needs satellite.norad_id' in done.err


def test_an_ephemeris_is_used_where_it_covers_the_pass_and_elsewhere_not(tmp_path: Path) -> None:
    config(tmp_path)
    keep(tmp_path, PLAIN, NEWER)
    tai_s = NOW_TAI_S - 3600.0 + np.arange(0.0, 6 * 3600.0, 60.0)
    rows = earth_fixed((tai_s, *Sgp4Propagator(NEWER).states_teme(tai_s)))
    text = cpf(rows).replace("2022  2 11 12", utc_text(NOW_TAI_S - 7200.0, 0)[:13].replace("-", " ").replace("T", " "))
    (tmp_path / "given" / "iss.cpf").write_text(text)
    assert choose(tmp_path).propagator.kind == "cpf"
    assert choose(tmp_path, NOW_TAI_S + 6 * 3600.0).propagator.kind == "omm"
    (tmp_path / "given" / "iss.cpf").write_text(text.replace("25544", "43013").replace(" iss ", " noaa "))
    assert choose(tmp_path).propagator.kind == "omm"


def test_a_set_that_is_doubted_waits_for_the_pass_that_bears_it_out(tmp_path: Path) -> None:
    config(tmp_path)
    keep(tmp_path, PLAIN, REBOOSTED)
    assert doubtful_file(tmp_path / "elements", 25544).exists()
    first = choose(tmp_path)
    assert any("is doubted: it puts the satellite 23" in one for one in first.warnings)
    assert (first.epoch_tai_s, first.confirmed_tai_s) == (pytest.approx(PLAIN.epoch_tai_s, abs=1e-5), None)
    seen = left(tmp_path, first.propagator, NOW_TAI_S, along_deg=2.0)
    soon, day = NOW_TAI_S + 5400.0, NOW_TAI_S + 1.1 * DAY_S
    then = choose(tmp_path, soon, seen, soon)
    assert (then.epoch_tai_s, then.confirmed_tai_s) == pytest.approx(
        (PLAIN.epoch_tai_s, REBOOSTED.epoch_tai_s), abs=1e-5
    )
    assert then.confirmed_tai_s is not None
    newest = replace(later(1.3), mean_anomaly_rad=later(1.3).mean_anomaly_rad + 2.0 * DEG)
    keep_set(tmp_path / "elements", WANTED, newest, URL, day)
    assert len(read_sets(doubtful_file(tmp_path / "elements", 25544), 25544)) == 2
    confirm_doubtful(tmp_path / "elements", 25544, then.confirmed_tai_s)
    assert not doubtful_file(tmp_path / "elements", 25544).exists()
    assert [one.epoch_tai_s for one in read_sets(sets_file(tmp_path / "elements", 25544), 25544)] == pytest.approx(
        [PLAIN.epoch_tai_s, REBOOSTED.epoch_tai_s, newest.epoch_tai_s], abs=1e-5
    )
    assert choose(tmp_path, day, seen, day).epoch_tai_s == pytest.approx(newest.epoch_tai_s, abs=1e-5)


def test_a_set_that_is_doubted_and_that_the_pass_belies_is_not_used(tmp_path: Path) -> None:
    config(tmp_path)
    keep(tmp_path, PLAIN, REBOOSTED)
    seen = left(tmp_path, choose(tmp_path).propagator, NOW_TAI_S, along_deg=0.01)
    day = NOW_TAI_S + 1.5 * DAY_S
    chosen = choose(tmp_path, day, seen, day)
    assert (chosen.epoch_tai_s, chosen.confirmed_tai_s) == (pytest.approx(PLAIN.epoch_tai_s, abs=1e-5), None)


def test_a_set_in_a_directory_that_an_older_one_contradicts_is_not_used_until_the_older_one_is_too_old(
    tmp_path: Path,
) -> None:
    config(tmp_path)
    keep(tmp_path, PLAIN)
    (tmp_path / "given" / "iss.json").write_text(json.dumps([record_of(REBOOSTED, "x")]))
    assert choose(tmp_path).epoch_tai_s == pytest.approx(PLAIN.epoch_tai_s, abs=1e-5)
    late = NOW_TAI_S + 29.9 * DAY_S
    assert choose(tmp_path, late, now_tai_s=late).epoch_tai_s == pytest.approx(REBOOSTED.epoch_tai_s, abs=1e-5)
    (tmp_path / "given" / "iss.json").write_text(json.dumps([record_of(NEWER, "x")]))
    assert choose(tmp_path).epoch_tai_s == pytest.approx(NEWER.epoch_tai_s, abs=1e-5)


def test_elements_that_the_last_pass_corrected_are_better_for_hours_and_newer_ones_after_a_day(tmp_path: Path) -> None:
    config(tmp_path)
    keep(tmp_path, PLAIN)
    seen = left(tmp_path, choose(tmp_path).propagator, NOW_TAI_S, along_deg=0.02)
    keep(tmp_path, NEWER)
    soon, days = NOW_TAI_S + 5400.0, NOW_TAI_S + 3.0 * DAY_S
    fresh = choose(tmp_path, soon, now_tai_s=soon)
    assert fresh.epoch_tai_s == pytest.approx(NEWER.epoch_tai_s, abs=1e-5)
    fitted = choose(tmp_path, soon, seen, soon)
    assert fitted.epoch_tai_s == pytest.approx(PLAIN.epoch_tai_s, abs=1e-5)
    assert fitted.expected_m < 0.6 * fresh.expected_m
    newest = later(3.05)
    keep(tmp_path, newest)
    assert choose(tmp_path, days, seen, days).epoch_tai_s == pytest.approx(newest.epoch_tai_s, abs=1e-5)


@pytest.mark.parametrize("norad_id", [99999, 100000, 270001, 339999, 340000, 799500124])
def test_catalogue_numbers_of_six_digits_and_more_are_known_everywhere(tmp_path: Path, norad_id: int) -> None:
    config(tmp_path, FROM_STATION.replace("25544", str(norad_id)))
    many = [replace(PLAIN, norad_id=200 + i, name=f"NUMBER {i}") for i in range(300)]
    text = json.dumps([record_of(one, "x") for one in [*many, replace(PLAIN, norad_id=norad_id)]])
    (tmp_path / "given" / "group.json").write_text(text)
    assert len(text) > 50_000
    done = acu_daemon("passes", "--config", tmp_path, "--from", utc_text(NOW_TAI_S, 0), "--json")
    assert done.code == 0
    assert len(json.loads(done.out)) >= 2
    shown = acu_daemon("elements", "show", "--config", tmp_path)
    assert f"ISS ({norad_id})" not in shown.out or shown.code == 1  # of 2022: too old by now, and told so
    assert f"({norad_id})" in shown.out


def test_files_of_a_directory_that_cannot_be_read_are_told_and_cost_nothing(tmp_path: Path) -> None:
    config(tmp_path)
    keep(tmp_path, NEWER)
    (tmp_path / "given" / "a.txt").write_text("<html><title>no</title></html>")
    (tmp_path / "given" / "b.tle").write_text(ISS)
    (tmp_path / "given" / "half.tle.part").write_text("1 2554")
    assert choose(tmp_path).epoch_tai_s == pytest.approx(NEWER.epoch_tai_s, abs=1e-5)
    said = acu_daemon("elements", "show", "--config", tmp_path).out
    assert "2 files; left out: " in said
    assert "a.txt: a web page, not elements: 'no'" in said
    checked = acu_daemon("check", "--config", tmp_path, "--at", utc_text(NOW_TAI_S, 0)).out
    assert "elements source" in checked


def test_a_fit_over_another_station_is_of_the_same_orbit_and_of_no_other_elements(tmp_path: Path) -> None:
    config(tmp_path)
    keep(tmp_path, PLAIN)
    seen = left(tmp_path, choose(tmp_path).propagator, NOW_TAI_S)
    site = load_station(tmp_path).site
    fit = LastFit(seen, replace(site, station=replace(site.station, name="elsewhere")), EstimatorSettings())
    assert fit.corrects(choose(tmp_path).propagator, NOW_TAI_S + 60.0)  # the orbit is the same from everywhere
    assert not fit.corrects(Sgp4Propagator(NEWER), NOW_TAI_S + 60.0)


def test_of_many_sets_the_newest_twelve_of_thirty_days_are_kept(tmp_path: Path) -> None:
    days = [-31.0, -30.0, *(-29.0 + 0.5 * k for k in range(4)), *(-0.5 * k for k in range(9, -1, -1))]
    sets = [replace(NEWER, epoch_tai_s=NEWER.epoch_tai_s + day * DAY_S) for day in days]
    path = tmp_path / "25544.json"
    elements_store._write(path, sets, URL)
    assert [one.epoch_tai_s for one in read_sets(path, 25544)] == pytest.approx([one.epoch_tai_s for one in sets[-12:]])
    elements_store._write(path, [*sets[:2], sets[-1]], URL)
    assert [one.epoch_tai_s for one in read_sets(path, 25544)] == pytest.approx(
        [sets[1].epoch_tai_s, NEWER.epoch_tai_s]
    )

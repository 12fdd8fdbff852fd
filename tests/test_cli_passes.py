"""`acu-daemon passes`: the coming passes as a table and as JSON, of one satellite or of all."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import Done, acu_daemon
from config_files import BROUWER, STATION, from_file, replaced, write
from made_element_sets import omm_text

from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

START = "1989-02-01T00:00:00Z"
SECOND = replaced(BROUWER, "SCD-1", "SCD-9").replace("raan_deg = 240.14", "raan_deg = 60.0")
MADE = ElementSet(
    *("omm", "MADE", 90_001, 0.0, 1.08e-3, 1e-3, 1.5, 2.0, 1.0, 0.0, 0.0, "made"),
)
# an object at its last day, from the SGP4 verification set (Vallado et al., AIAA 2006-6753): decays within a day
DECAYING = """1 29141U 85108AA  06170.26783845  .99999999  00000-0  13519-0 0   718
2 29141  82.4288 273.4882 0015848 277.2124  83.9133 15.93343074  6828
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return write(tmp_path, scd=BROUWER, second=SECOND)


def passes(config: Path, *more: object) -> Done:
    return acu_daemon("passes", "--config", config, "--from", START, *more)


def test_json_gives_every_pass_with_rise_culmination_and_set_in_order(config: Path) -> None:
    done = passes(config, "--satellite", "scd", "--json")
    assert (done.code, done.err) == (0, "")
    found = json.loads(done.out)
    assert len(found) >= 5
    last = tai_from_utc(START)
    for one in found:
        assert one["satellite"] == "scd"
        rise, top, end = (tai_from_utc(one[f"{key}_utc"]) for key in ("rise", "culmination", "set"))
        assert last <= rise < top < end
        assert one["duration_s"] == pytest.approx(end - rise, abs=0.002)
        assert 5.0 <= one["culmination_el_deg"] <= 90.0
        assert all(0.0 <= one[f"{key}_az_deg"] < 360.0 for key in ("rise", "culmination", "set"))
        last = end


def test_a_table_has_a_line_a_pass_in_the_order_of_the_rises(config: Path) -> None:
    done = passes(config)
    header, *lines = done.out.splitlines()
    assert done.code == 0
    assert header.split()[:3] == ["satellite", "rise", "UTC"]
    found = json.loads(passes(config, "--json").out)
    assert [line.split()[0] for line in lines] == [one["satellite"] for one in found]
    assert {one["satellite"] for one in found} == {"scd", "second"}
    rises = [" ".join(line.split()[1:3]) for line in lines]
    assert rises == sorted(rises)
    for line, one in zip(lines, found, strict=True):
        assert float(line.split()[5]) == pytest.approx(one["culmination_el_deg"], abs=0.051)


def test_a_pass_in_progress_at_the_start_is_shown_with_its_true_rise(config: Path) -> None:
    first = json.loads(passes(config, "--satellite", "scd", "--json").out)[0]
    middle = acu_daemon(
        "passes", "--config", config, "--satellite", "scd", "--json", "--from", first["culmination_utc"]
    )
    assert json.loads(middle.out)[0]["rise_utc"] == first["rise_utc"]


def test_nothing_to_show_is_said_with_what_to_do(config: Path) -> None:
    first = json.loads(passes(config, "--satellite", "scd", "--json").out)[0]
    after = utc_text(tai_from_utc(first["set_utc"]) + 60.0)
    asked = ("passes", "--config", config, "--satellite", "scd", "--from", after, "--days", "0.01")
    done = acu_daemon(*asked)
    assert done.code == 0
    assert "no pass within 0.01 days; try --days 0.03" in done.out
    assert json.loads(acu_daemon(*asked, "--json").out) == []


def test_old_elements_are_warned_of_and_still_shown(config: Path) -> None:
    done = acu_daemon("passes", "--config", config, "--satellite", "scd", "--from", "1989-04-15T00:00:00Z", "--json")
    assert done.code == 0
    assert "days old, the limit is 30 days; fetch newer elements" in done.err
    assert json.loads(done.out)


def test_a_decayed_satellite_hides_no_other_one(tmp_path: Path) -> None:
    write(tmp_path, gone=from_file("GONE", "tle", "gone.tle"), scd=BROUWER)
    (tmp_path / "satellites" / "gone.tle").write_text(DECAYING)
    start = ("--from", "2006-06-19T14:00:00Z")
    all_of_them = acu_daemon("passes", "--config", tmp_path, *start, "--json")
    assert all_of_them.code == 0
    assert "warning: gone is left out: NORAD 29141: no position at " in all_of_them.err
    found = json.loads(all_of_them.out)
    assert {one["satellite"] for one in found["passes"]} == {"scd"}
    [omitted] = found["omitted"]
    assert omitted["satellite"] == "gone"
    assert "the satellite has decayed" in omitted["reason"]
    alone = acu_daemon("passes", "--config", tmp_path, *start, "--satellite", "gone")
    assert (alone.code, alone.out) == (2, "")
    assert "the satellite has decayed" in alone.err


def test_each_pass_is_computed_from_the_set_of_its_file_that_is_nearest_to_it(tmp_path: Path) -> None:
    epochs = [tai_from_utc(f"2022-02-{day}T00:00:00Z") for day in (11, 13, 15)]
    sets = [replace(MADE, epoch_tai_s=one, mean_anomaly_rad=0.3 * k) for k, one in enumerate(epochs)]
    write(tmp_path, many=from_file("MADE", "omm", "many.json"))
    (tmp_path / "satellites" / "many.json").write_text(omm_text(sets))
    start = "2022-02-11T06:00:00Z"
    done = acu_daemon("passes", "--config", tmp_path, "--from", start, "--days", "4", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert {one["elements_epoch_utc"] for one in found} == {utc_text(one) for one in epochs}
    for one in found:
        rise_tai_s = tai_from_utc(one["rise_utc"])
        nearest = min(range(3), key=lambda k: abs(epochs[k] - rise_tai_s))
        assert one["elements_epoch_utc"] == utc_text(epochs[nearest])
        (tmp_path / "satellites" / "many.json").write_text(omm_text([sets[nearest]]))
        around = utc_text(rise_tai_s - 600.0)
        alone = acu_daemon("passes", "--config", tmp_path, "--from", around, "--days", "0.02", "--json")
        found_tai_s = tai_from_utc(json.loads(alone.out)[0]["rise_utc"])
        assert found_tai_s == pytest.approx(rise_tai_s, abs=0.002)
    assert "each pass is computed from the set nearest to it" in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--from", "1989-02-01"), "--from '1989-02-01': '1989-02-01': expected UTC as YYYY-MM-DDThh:mm:ss[.fff]Z"),
        (("--satellite", "moon"), "moon.toml: no such file; satellites in "),
        (("--days", "0"), "--days"),
        (("--days", "x"), "--days"),
    ],
)
def test_wrong_use_ends_with_status_2_and_a_reason(config: Path, arguments: tuple[str, ...], said: str) -> None:
    done = passes(config, *arguments)
    assert done.code == 2
    assert said in done.err
    assert "Traceback" not in done.err


def test_a_directory_without_satellites_is_told_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "satellites").mkdir()
    done = passes(tmp_path)
    assert done.code == 2
    assert "satellites holds no satellite; put a NAME.toml there" in done.err


def test_every_line_of_a_complaint_names_the_program(tmp_path: Path) -> None:
    write(tmp_path, "[station]\n")
    done = passes(tmp_path, "--satellite", "scd")
    assert done.code == 2
    assert len(done.err.splitlines()) >= 2
    assert all(line.startswith("acu-daemon: ") for line in done.err.splitlines())


def test_a_pass_that_an_axis_cannot_follow_says_which_from_when_and_for_how_long(tmp_path: Path) -> None:
    flat = replaced(STATION, "min_deg = 0.0\nmax_deg = 90.0", "min_deg = 0.0\nmax_deg = 30.0")
    config = write(tmp_path, flat, scd=BROUWER)
    found = json.loads(passes(config, "--json").out)
    high = [one for one in found if one["culmination_el_deg"] > 31.0]
    assert high
    for one in found:
        beyond = [span for span in one["beyond_limits"] if span["axis"] == "elevation"]
        assert bool(beyond) is (one["culmination_el_deg"] > 30.0)
    [span] = high[0]["beyond_limits"]
    assert tai_from_utc(high[0]["rise_utc"]) < tai_from_utc(span["from_utc"]) < tai_from_utc(high[0]["culmination_utc"])
    assert "elevation above 30 deg" in passes(config).out

"""Of several sources of an orbit the one that is expected to be off the least: ages, fits, doubts, and the words."""

from dataclasses import replace
from math import hypot, inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from test_elements import ISS, NOW

from acu_daemon.cli.elements_watch import STILL_BEST, why_worse
from acu_daemon.edge.elements_choice import (
    MOST_FILES,
    ElementsSources,
    _by_age_m,
    _doubt,
    _doubts_told,
    _judged,
    _km,
    _why,
    files_of,
)
from acu_daemon.edge.elements_file import LoadedElements
from acu_daemon.edge.elements_store import doubtful_file, sets_file
from acu_daemon.edge.fetch_state_file import group_file
from acu_daemon.model import Pass
from acu_daemon.orbit.aging import expected_error
from acu_daemon.orbit.set_judgement import MOST_SIGMAS, Judged, Judgement
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

STORE, GIVEN = Path("/store"), Path("/given")
SOURCES = ElementsSources(STORE, ("https://a",), (GIVEN,))
NUMBER = 25544
AT = NOW + 0.5 * DAY_S


def loaded(
    file: Path | str, days: float = 0.0, shifted_rad: float = 0.0, errors: tuple[str, ...] = ()
) -> LoadedElements:
    """The orbit of one set, told at its epoch or days later, and moved along its track."""
    turned = ISS.mean_anomaly_rad + ISS.mean_motion_rad_s * days * DAY_S + shifted_rad
    elements = replace(ISS, epoch_tai_s=NOW + days * DAY_S, mean_anomaly_rad=turned % 6.283185307179586)
    return LoadedElements(Sgp4Propagator(elements), ISS.label, elements.epoch_tai_s, list(errors), [], file=str(file))


def fit(at_days: float, corrects: bool = False, fit_m: float = 500.0, off_m: float = 0.0) -> Any:
    return SimpleNamespace(
        carried=SimpleNamespace(at_tai_s=NOW + at_days * DAY_S),
        corrects=lambda propagator, now_tai_s: corrects,
        expected_m=lambda propagator, at_tai_s: fit_m,
        off_m=lambda propagator: off_m,
    )


AGED_M = expected_error(ISS, AT).along_m


@pytest.mark.parametrize(
    ("last", "doubt_m", "expected_m", "is_confirmed"),
    [
        (None, 0.0, AGED_M, False),
        (None, 40e3, hypot(AGED_M, 40e3), False),
        (fit(0.1, corrects=True, fit_m=100.0), 0.0, 100.0, False),
        (fit(0.1, corrects=True, fit_m=1e9), 0.0, AGED_M, False),
        (fit(0.0, corrects=True, fit_m=100.0), 0.0, 100.0, False),
        (fit(-0.1, corrects=True, fit_m=100.0), 0.0, AGED_M, False),  # a fit from before the elements says nothing
        (fit(-0.1, off_m=1e9), 0.0, AGED_M, False),
        (fit(0.1, off_m=1e6), 0.0, hypot(AGED_M, 1e6), False),
        (fit(0.1, off_m=10.0), 0.0, AGED_M, False),
        (fit(0.1, off_m=10.0), 40e3, AGED_M, True),
        (fit(0.1, off_m=1e6), 40e3, hypot(AGED_M, 1e6), False),
        (fit(0.1, off_m=1e6), 2e6, hypot(AGED_M, 2e6), False),
        (fit(-0.1, off_m=10.0), 40e3, hypot(AGED_M, 40e3), False),
    ],
)
def test_a_source_is_off_by_its_age_its_doubt_and_what_a_later_fit_says(
    last: Any, doubt_m: float, expected_m: float, is_confirmed: bool
) -> None:
    found = _judged(loaded("/a"), doubt_m, AT, AT, last)
    assert found.expected_m == pytest.approx(expected_m)
    assert found.confirmed_tai_s == (NOW if is_confirmed else None)


@pytest.mark.parametrize(("share", "is_within"), [(0.999, True), (1.001, False)])
def test_a_fit_contradicts_elements_beyond_five_sigmas_of_its_own_time(share: float, is_within: bool) -> None:
    allowed_m = MOST_SIGMAS * expected_error(ISS, NOW + 0.1 * DAY_S).along_m
    found = _judged(loaded("/a"), 0.0, AT, AT, fit(0.1, off_m=share * allowed_m))
    assert found.expected_m == pytest.approx(AGED_M if is_within else hypot(AGED_M, share * allowed_m))
    doubted = _judged(loaded("/a"), 1.0, AT, AT, fit(0.1, off_m=share * allowed_m))
    assert (doubted.confirmed_tai_s is not None) == is_within


def test_elements_of_no_known_ageing_are_the_last_choice() -> None:
    source: Any = SimpleNamespace(kind="brouwer")
    assert _by_age_m(source, AT) == inf
    assert _by_age_m(loaded("/a").propagator, AT) == AGED_M


@pytest.mark.parametrize(
    ("file", "is_asked"),
    [
        (GIVEN / "a.tle", True),
        (doubtful_file(STORE, NUMBER), True),
        (sets_file(STORE, NUMBER), False),
        ("/config/satellites/iss.tle", False),
        (GIVEN / "below" / "a.tle", False),
    ],
)
def test_what_others_give_is_doubted_where_an_older_set_contradicts_it(file: Path | str, is_asked: bool) -> None:
    mine, old = loaded(file, 1.0, shifted_rad=0.2), loaded(sets_file(STORE, 7))
    found = _doubt(mine, [mine, old], NUMBER, SOURCES)
    assert (found is not None) == is_asked
    if found is not None:
        assert found.judged is Judged.DOUBTFUL
        assert found.shift_m == pytest.approx(0.2 * 6.8e6, rel=0.1)
    near = loaded(file, 1.0)
    assert _doubt(near, [near, replace(old, propagator=near.propagator)], NUMBER, SOURCES) is None


@pytest.mark.parametrize(
    "other",
    [
        loaded(GIVEN / "b.tle", 1.0),  # as old
        loaded(GIVEN / "b.tle", 2.0),
        loaded(GIVEN / "a.tle", 0.0),  # of the same file
        loaded(doubtful_file(STORE, NUMBER), 0.0),
        replace(loaded(GIVEN / "b.tle"), propagator=SimpleNamespace(kind="oem")),  # type: ignore[arg-type]
    ],
)
def test_only_an_older_set_of_another_file_that_is_not_doubted_itself_contradicts(other: LoadedElements) -> None:
    mine = loaded(GIVEN / "a.tle", 1.0, shifted_rad=0.2)
    assert _doubt(mine, [other, mine], NUMBER, SOURCES) is None


def test_the_newest_of_the_older_sets_decides() -> None:
    mine = loaded(GIVEN / "a.tle", 1.0, shifted_rad=0.2)
    far, near = loaded("/far", 0.0), loaded("/near", 0.5, shifted_rad=0.2)
    assert _doubt(mine, [far, mine], NUMBER, SOURCES) is not None
    for found in ([far, near, mine], [near, far, mine]):
        judgement = _doubt(mine, found, NUMBER, SOURCES)
        assert judgement is None or judgement.shift_m < 0.1 * 0.2 * 6.8e6


def test_a_set_as_new_in_another_file_does_not_speak_for_it() -> None:
    mine, twin = loaded(GIVEN / "a.tle", 1.0, shifted_rad=0.2), loaded(GIVEN / "b.tle", 1.0, shifted_rad=0.2)
    assert _doubt(mine, [mine, twin, loaded("/far", 0.0)], NUMBER, SOURCES) is not None


def test_doubts_are_told_of_what_is_not_used_nor_borne_out() -> None:
    doubt = Judgement(Judged.DOUBTFUL, 50e3, 1e3)
    best, other, sure, plain = loaded("/best"), loaded("/other"), loaded("/sure"), loaded("/plain")
    sure = replace(sure, confirmed_tai_s=NOW)
    told = list(_doubts_told(best, [best, other, sure, plain], [doubt, doubt, doubt, None]))
    assert told == [
        f"/other: ISS (ZARYA) (25544): the set of {utc_text(NOW, 0)} is doubted: {doubt}; a pass will decide"
    ]


def test_why_a_source_is_used_names_the_next_best_one_and_those_with_errors_last() -> None:
    best, far = replace(loaded("/best"), expected_m=1234.0), replace(loaded("/far", 1.0), expected_m=98_765.0)
    bad = replace(loaded("/bad", errors=("so",)), expected_m=10.0)
    said = _why(best, [far, best, bad], AT)
    assert said == (
        f"/best: ISS (ZARYA) (25544): of 3 sources the one of {utc_text(NOW, 0)} is used (tle): expected to be 1.2 km "
        f"off along the track at {utc_text(AT, 0)}; the next is /far (tle of {utc_text(NOW + DAY_S, 0)}), 99 km"
    )
    confirmed = replace(best, confirmed_tai_s=NOW)
    assert "is used (tle), borne out by the last pass: expected" in _why(confirmed, [confirmed, far], AT)
    assert _why(replace(best, choice="so"), [best], AT) == "so"


@pytest.mark.parametrize(
    ("metres", "text"),
    [(1234.0, "1.2 km"), (98_765.0, "99 km"), (1_234_567.0, "1200 km"), (40.0, "0.04 km"), (inf, "of no use then")],
)
def test_kilometres_have_two_figures(metres: float, text: str) -> None:
    assert _km(metres) == text


def test_a_directory_gives_its_files_sorted_without_those_that_are_hidden_or_being_written(tmp_path: Path) -> None:
    for name in ("b.tle", "a.txt", ".hidden", "x.tmp", "x.part", "x.new", "x.toml", "x~"):
        (tmp_path / name).write_text("")
    (tmp_path / "folder").mkdir()
    assert files_of(tmp_path) == [tmp_path / "a.txt", tmp_path / "b.tle"]
    assert files_of(tmp_path / "gone") == []
    for k in range(MOST_FILES + 1):
        (tmp_path / f"c{k:04}").write_text("")
    found = files_of(tmp_path)
    assert len(found) == MOST_FILES
    assert found[-1].name == f"c{MOST_FILES - 3:04}"


def test_what_is_kept_for_a_satellite_comes_before_the_groups_and_the_directories(tmp_path: Path) -> None:
    (tmp_path / "a.tle").write_text("")
    sources = ElementsSources(STORE, ("https://a", "https://b"), (tmp_path,))
    assert sources.files(NUMBER) == [
        sets_file(STORE, NUMBER),
        doubtful_file(STORE, NUMBER),
        group_file(STORE, "https://a"),
        group_file(STORE, "https://b"),
        tmp_path / "a.tle",
    ]
    assert ElementsSources(STORE, (), (tmp_path,)).files(NUMBER) == [tmp_path / "a.tle"]


# New ones, where all sources were compared

COMING = Pass(AT, AT + 300.0, AT + 600.0, 10.0, 60.0, 90.0, 170.0)


def target(elements: LoadedElements, expected_m: float = nan) -> Any:
    none = SimpleNamespace(position_km=None, velocity_m_s=None)
    return SimpleNamespace(
        elements=replace(elements, expected_m=expected_m), satellite=SimpleNamespace(uncertainty=none)
    )


def test_of_compared_sources_another_file_or_epoch_is_taken_and_the_same_one_is_not() -> None:
    mine = target(loaded("/a"), 100.0)
    assert why_worse(mine, target(loaded("/a"), 900.0), COMING) == STILL_BEST
    assert why_worse(mine, target(loaded("/b"), 900.0), COMING) == ""
    assert why_worse(mine, target(loaded("/a", 0.001), 900.0), COMING) == ""
    assert why_worse(mine, target(loaded("/b", -0.3), 900.0), COMING) == ""  # older, and better all the same


def test_of_compared_sources_one_that_is_doubted_waits_until_it_is_borne_out() -> None:
    mine, doubted = target(loaded("/a"), 100.0), loaded("/b", 0.3, shifted_rad=0.2)
    assert why_worse(mine, target(doubted, 900.0), COMING).startswith("the new ones are doubted: it puts the satellite")
    assert why_worse(mine, target(replace(doubted, confirmed_tai_s=NOW), 900.0), COMING) == ""

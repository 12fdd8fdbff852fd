"""What `acu-daemon passes` makes of what it found: table, notes, JSON, and from which set each pass is computed."""

import json
import sys
from dataclasses import replace
from math import inf
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, NamedTuple

import pytest

from acu_daemon.cli import coming_passes
from acu_daemon.cli.coming_passes import _as_json, _as_text, _Seen, _show, passes_by_epoch
from acu_daemon.errors import UsageError
from acu_daemon.model import Pass
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.pointing.outage import KeptOut, SunOutage
from acu_daemon.pointing.reach import OutOfReach
from acu_daemon.units import DAY_S

START = tai_from_utc("2026-03-01T12:00:00Z")
END = START + 2.0 * DAY_S
RISE = START + 3600.0
ONE = Pass(RISE, RISE + 301.5, RISE + 605.4, 12.3456, 67.8912, 101.2346, 190.9876)
EPOCH = START - 7.0 * DAY_S


def seen(*passes: Pass, why_none: str = "", **more: Any) -> _Seen:
    nothing: dict[str, Any] = {name: dict.fromkeys(passes, ()) for name in ("beyond", "sun", "zones")}
    given = {"epochs_tai_s": dict.fromkeys(passes, EPOCH), "propagators": {}} | nothing | more
    return _Seen(list(passes), why_none=why_none, said=[], **given)


def shown(
    capsys: pytest.CaptureFixture[str],
    found: dict[str, _Seen],
    omitted: dict[str, str] | None = None,
    *,
    as_json: bool = False,
    end_tai_s: float = END,
) -> str:
    _show(found, omitted or {}, START, end_tai_s, as_json=as_json)
    return capsys.readouterr().out


# The table


@pytest.mark.parametrize(
    ("duration_s", "text"), [(605.4, "10:05"), (59.4, "0:59"), (59.6, "1:00"), (119.6, "2:00"), (3661.0, "61:01")]
)
def test_a_line_has_its_figures_in_the_order_of_the_columns(duration_s: float, text: str) -> None:
    line = _as_text("scd", replace(ONE, set_tai_s=RISE + duration_s))
    assert line.split() == ["scd", "2026-03-01", "13:00:00", text, "12.3", "67.9", "101.2", "191.0"]


def test_the_table_has_all_satellites_in_the_order_of_the_rises(capsys: pytest.CaptureFixture[str]) -> None:
    late, early = replace(ONE, rise_tai_s=RISE + 60.0), replace(ONE, rise_tai_s=RISE - 60.0)
    head, *lines = shown(capsys, {"a": seen(ONE), "b": seen(early, late)}).splitlines()
    assert [line.split()[0] for line in lines] == ["b", "a", "b"]
    for word in ("rise UTC", "min:s", "az deg", "top el", "top az", "set az"):
        assert word in head
    ends = [head.index(word) + len(word) for word in ("min:s", "az deg", "top el", "top az", "set az")]
    assert [lines[1][:end].split()[-1] for end in ends] == ["10:05", "12.3", "67.9", "101.2", "191.0"]


@pytest.mark.parametrize(
    ("one", "note"),
    [
        (ONE, ""),
        (replace(ONE, rise_tai_s=START), "does not rise"),
        (replace(ONE, set_tai_s=END), "does not set"),
        (replace(ONE, rise_tai_s=START, set_tai_s=END), "always up: does not set"),
        (replace(ONE, hidden_tai_s=((RISE + 10.0, RISE + 24.6),)), "behind the mask 15 s from 13:00:10"),
    ],
)
def test_a_note_stands_behind_the_line(capsys: pytest.CaptureFixture[str], one: Pass, note: str) -> None:
    _, line = shown(capsys, {"a": seen(one)}).splitlines()
    assert line == f"{_as_text('a', one)}  {note}".rstrip()


def test_all_notes_of_a_pass_stand_in_one_order(capsys: pytest.CaptureFixture[str]) -> None:
    one = replace(ONE, rise_tai_s=START, hidden_tai_s=((RISE, RISE + 9.0), (RISE + 60.0, RISE + 70.0)))
    sun = SunOutage(RISE, RISE + 20.0, 1.25, RISE + 10.0)
    zone = KeptOut("mast", RISE + 30.0, RISE + 35.0)
    reach = OutOfReach("elevation", RISE + 61.0, RISE + 68.4, "above its limit")
    of = seen(one, sun={one: (sun,)}, zones={one: (zone,)}, beyond={one: (reach,)})
    _, line = shown(capsys, {"a": of}).splitlines()
    assert line.removeprefix(_as_text("a", one)).strip().split("; ") == [
        "does not rise",
        "behind the mask 9 s from 13:00:00",
        "behind the mask 10 s from 13:01:00",
        str(sun),
        str(zone),
        "above its limit 7 s from 13:01:01",
    ]


@pytest.mark.parametrize(("days", "more"), [(1.0, "3"), (25.0, "60"), (0.01, "0.03")])
def test_where_there_is_no_pass_a_longer_search_is_advised(
    capsys: pytest.CaptureFixture[str], days: float, more: str
) -> None:
    said = shown(capsys, {"a": seen()}, end_tai_s=START + days * DAY_S).splitlines()
    assert said[1:] == [f"no pass within {days:g} days; try --days {more}"]


def test_a_satellite_that_never_comes_says_why_and_the_advice_is_for_others_alone(
    capsys: pytest.CaptureFixture[str],
) -> None:
    never = seen(why_none="too far south")
    assert shown(capsys, {"a": never}).splitlines()[1:] == ["a: too far south"]
    assert shown(capsys, {"a": never, "b": seen()}).splitlines()[1:] == [
        "a: too far south",
        "no pass within 2 days; try --days 6",
    ]
    assert len(shown(capsys, {"a": never, "b": seen(ONE)}).splitlines()) == 3


def test_where_nothing_could_be_used_no_head_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(capsys, {}, {"a": "no file"}) == ""


# JSON


def test_a_pass_in_json_has_each_figure_under_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    one = replace(ONE, hidden_tai_s=((RISE + 10.0, RISE + 24.6789),))
    sun = SunOutage(RISE, RISE + 20.0, 1.23456, RISE + 10.0)
    zone = KeptOut("mast", RISE + 30.0, RISE + 35.0)
    reach = OutOfReach("elevation", RISE + 61.0, RISE + 68.4, "above its limit")
    of = seen(one, sun={one: (sun,)}, zones={one: (zone,)}, beyond={one: (reach,)})
    [found] = json.loads(shown(capsys, {"a": of}, as_json=True))

    def span(from_s: float, to_s: float) -> dict[str, Any]:
        return {
            "from_utc": utc_text(RISE + from_s),
            "to_utc": utc_text(RISE + to_s),
            "duration_s": round(to_s - from_s, 3),
        }

    assert found == {
        "satellite": "a",
        "rise_utc": utc_text(RISE),
        "culmination_utc": utc_text(RISE + 301.5),
        "set_utc": utc_text(RISE + 605.4),
        "duration_s": 605.4,
        "rise_az_deg": 12.346,
        "culmination_az_deg": 101.235,
        "culmination_el_deg": 67.891,
        "set_az_deg": 190.988,
        "does_not_rise": False,
        "does_not_set": False,
        "hidden": [span(10.0, 24.6789)],
        "elements_epoch_utc": utc_text(EPOCH),
        "beyond_limits": [span(61.0, 68.4) | {"axis": "elevation", "why": "above its limit"}],
        "sun": [span(0.0, 20.0) | {"least_deg": 1.235, "least_utc": utc_text(RISE + 10.0)}],
        "keep_outs": [span(30.0, 35.0) | {"name": "mast"}],
    }


@pytest.mark.parametrize(("off_s", "is_open"), [(-0.001, False), (0.0, True), (0.001, False)])
def test_a_pass_without_a_rise_or_a_set_says_so_in_json(off_s: float, is_open: bool) -> None:
    rise = _as_json("a", replace(ONE, rise_tai_s=START + off_s), START, END)
    assert (rise["does_not_rise"], rise["does_not_set"]) == (is_open, False)
    end = _as_json("a", replace(ONE, set_tai_s=END + off_s), START, END)
    assert (end["does_not_rise"], end["does_not_set"]) == (False, is_open)


def test_json_is_a_list_in_order_and_an_object_where_satellites_are_left_out(
    capsys: pytest.CaptureFixture[str],
) -> None:
    early = replace(ONE, rise_tai_s=RISE - 60.0)
    found = {"a": seen(ONE), "b": seen(early)}
    plain = json.loads(shown(capsys, found, as_json=True))
    assert [one["satellite"] for one in plain] == ["b", "a"]
    with_omitted = json.loads(shown(capsys, found, {"c": "no file"}, as_json=True))
    assert with_omitted == {"passes": plain, "omitted": [{"satellite": "c", "reason": "no file"}]}


# From which set


class Sky:
    """Sets of elements at epochs, each of which has the same passes; remembers what was asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, epochs_s: list[float], rises_s: list[float]) -> None:
        self.epochs_tai_s = tuple(START + one for one in epochs_s)
        self.passes = [replace(ONE, rise_tai_s=START + one, set_tai_s=START + one + 600.0) for one in rises_s]
        self.searched: list[tuple[float, float, float, float]] = []
        self.loaded: list[tuple[Any, ...]] = []
        monkeypatch.setattr(coming_passes, "find_passes", self._find)
        monkeypatch.setattr(coming_passes, "load_target", self._load)

    def target(self, epoch_tai_s: float, epochs_tai_s: tuple[float, ...] | None = None) -> Any:
        elements = SimpleNamespace(
            propagator=epoch_tai_s,
            epoch_tai_s=epoch_tai_s,
            epochs_tai_s=self.epochs_tai_s if epochs_tai_s is None else epochs_tai_s,
        )
        station = SimpleNamespace(site="here", station=SimpleNamespace(min_elevation_deg=7.0))
        return SimpleNamespace(elements=elements, station=station)

    def _find(self, propagator: float, site: str, from_tai_s: float, to_tai_s: float, lowest_deg: float) -> list[Pass]:
        assert site == "here"
        self.searched.append((propagator - START, from_tai_s - START, to_tai_s - START, lowest_deg))
        return [one for one in self.passes if one.set_tai_s > from_tai_s and one.rise_tai_s < to_tai_s]

    def _load(self, config: Path, name: str, now_tai_s: float, *, is_strict: bool, at_tai_s: float) -> Any:
        self.loaded.append((config, name, now_tai_s - START, is_strict, at_tai_s - START))
        return self.target(at_tai_s)

    def by_epoch(self, epoch_s: float, end_s: float = 1e6) -> list[tuple[float, list[float]]]:
        found = passes_by_epoch(Path("c"), "scd", self.target(START + epoch_s), START, START + end_s)
        return [(of.elements.epoch_tai_s - START, [one.rise_tai_s - START for one in part]) for of, part in found]


def test_each_pass_is_of_the_set_nearest_to_its_rise_and_of_the_older_one_in_the_middle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sky = Sky(monkeypatch, [0.0, 20_000.0, 90_000.0], [1000.0, 10_000.0, 10_700.0, 54_999.0, 55_001.0, 200_000.0])
    assert sky.by_epoch(0.0) == [
        (0.0, [1000.0, 10_000.0]),
        (20_000.0, [10_700.0, 54_999.0]),
        (90_000.0, [55_001.0, 200_000.0]),
    ]
    assert sky.loaded == [(Path("c"), "scd", 0.0, False, 20_000.0), (Path("c"), "scd", 0.0, False, 90_000.0)]
    assert sky.searched == [
        (0.0, 0.0, 1e6, 7.0),
        (20_000.0, 10_601.0, 1e6, 7.0),
        (90_000.0, 55_600.0, 1e6, 7.0),
    ]


def test_a_set_of_which_no_pass_is_counts_only_where_it_is_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    sky = Sky(monkeypatch, [0.0, 20_000.0, 90_000.0], [80_000.0, 81_000.0])
    assert sky.by_epoch(0.0) == [(0.0, []), (90_000.0, [80_000.0, 81_000.0])]
    assert sky.searched[1][1] == 0.0  # from where the search began
    assert Sky(monkeypatch, [0.0], []).by_epoch(0.0) == [(0.0, [])]


def test_a_newer_set_of_which_no_pass_is_is_passed_over_on_the_way_to_the_nearest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sky = Sky(monkeypatch, [0.0, 50_000.0, 90_000.0], [1000.0, 80_000.0])
    given = iter([50_000.0, 90_000.0])
    monkeypatch.setattr(coming_passes, "load_target", lambda *_, **__: sky.target(START + next(given)))
    assert sky.by_epoch(0.0) == [(0.0, [1000.0]), (90_000.0, [80_000.0])]
    assert [from_s for _, from_s, *_ in sky.searched] == [0.0, 1601.0, 1601.0]


def test_what_rose_before_the_search_counts_as_at_its_start(monkeypatch: pytest.MonkeyPatch) -> None:
    sky = Sky(monkeypatch, [-900.0, 500.0], [-300.0])
    assert sky.by_epoch(-900.0) == [(-900.0, []), (500.0, [-300.0])]


def test_without_a_list_of_sets_the_one_in_hand_is_the_nearest(monkeypatch: pytest.MonkeyPatch) -> None:
    sky = Sky(monkeypatch, [], [1000.0, 500_000.0])
    assert sky.by_epoch(0.0) == [(0.0, [1000.0, 500_000.0])]


@pytest.mark.parametrize("better_s", [-1.0, 0.0])
def test_where_no_newer_set_is_given_the_one_before_has_all_that_is_left(
    monkeypatch: pytest.MonkeyPatch, better_s: float
) -> None:
    sky = Sky(monkeypatch, [0.0, 20_000.0], [1000.0, 50_000.0, 60_000.0])
    monkeypatch.setattr(coming_passes, "load_target", lambda *_, **__: sky.target(START + better_s))
    assert sky.by_epoch(0.0) == [(0.0, [1000.0, 50_000.0, 60_000.0])]


# What is said of a search


def searched(monkeypatch: pytest.MonkeyPatch, *, spans: Any = ((-inf, inf),), rises_s: Any = (), **more: Any) -> _Seen:
    """Search with elements of which nothing is known but what is given."""
    sky = Sky(monkeypatch, [0.0], list(rises_s))
    target = sky.target(START)
    said = {"errors": [], "warnings": [], "choice": "", "label": "SCD"} | more
    target.elements.__dict__.update(said)
    limits = SimpleNamespace(limits=lambda: "limits")
    target.station.acu = SimpleNamespace(azimuth=limits, elevation=limits)
    target.station.bounds = SimpleNamespace(sun="sun", keep_outs="zones")
    target.elements.propagator = SimpleNamespace(states_teme=lambda tai_s: None)
    monkeypatch.setattr(coming_passes, "load_target", lambda *_given, **_more: target)
    monkeypatch.setattr(coming_passes, "is_ephemeris", lambda _: more.get("is_ephemeris", False))
    monkeypatch.setattr(coming_passes, "spans_tai_s", lambda _: [(START + a, START + b) for a, b in spans])
    monkeypatch.setattr(coming_passes, "find_passes", lambda *_: sky.passes)
    for name in ("beginning", "ending"):
        monkeypatch.setattr(coming_passes, name, lambda *_given, name=name: more.get(name, ""))
    for name in ("gaps", "cut_passes"):
        monkeypatch.setattr(coming_passes, name, lambda *_given, name=name: more.get(name, []))
    monkeypatch.setattr(coming_passes, "beyond_limits", lambda *given: ("beyond", *given[2:]))
    monkeypatch.setattr(coming_passes, "sun_outages", lambda *given: ("sun", *given[2:]))
    monkeypatch.setattr(coming_passes, "kept_out", lambda *given: ("zone", *given[2:]))
    monkeypatch.setattr(coming_passes, "why_none", lambda *given: f"none above {given[-1]:g}")
    return coming_passes._search(Path("c"), "scd", START, END)


def test_all_that_there_is_to_say_of_elements_stands_in_one_order(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {"errors": ["e"], "warnings": ["w"], "choice": "c", "beginning": "b", "ending": "d"}
    found = searched(monkeypatch, gaps=["g"], cut_passes=["p"], **given)
    assert found.said == [
        "warning: e",
        "warning: w",
        "note: c",
        "warning: scd: b",
        "warning: scd: d, no pass is looked for after that",
        "warning: scd: g",
        "warning: scd: p",
    ]
    assert searched(monkeypatch).said == []


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ({}, "none above 7"),
        ({"rises_s": (9.0,)}, ""),
        ({"ending": "it decays"}, ""),
        ({"is_ephemeris": True}, ""),
    ],
)
def test_why_there_is_none_is_told_where_nothing_else_tells_it(
    monkeypatch: pytest.MonkeyPatch, more: dict[str, Any], why: str
) -> None:
    assert searched(monkeypatch, **more).why_none == why


def test_each_pass_has_its_outages_and_its_epoch(monkeypatch: pytest.MonkeyPatch) -> None:
    found = searched(monkeypatch, rises_s=(9.0, 9000.0))
    for one in found.passes:
        got: Any = found.beyond[one], found.sun[one], found.zones[one]
        assert got == (("beyond", one, "limits", "limits"), ("sun", "sun", one), ("zone", "zones", one))
        assert found.epochs_tai_s[one] == START
    assert len(found.passes) == len(found.beyond) == 2


SEARCH_S = END - START


@pytest.mark.parametrize(
    ("spans", "is_known"),
    [
        (((-9.0, -1.0),), False),
        (((-9.0, 0.0),), True),
        (((SEARCH_S, SEARCH_S + 9.0),), True),
        (((SEARCH_S + 1.0, SEARCH_S + 9.0),), False),
        (((-9.0, -1.0), (5.0, 9.0)), True),
        (((-9.0, SEARCH_S + 9.0),), True),
    ],
)
def test_a_search_beside_all_that_is_known_is_refused_unless_an_ephemeris_tells_its_gaps(
    monkeypatch: pytest.MonkeyPatch, spans: Any, is_known: bool
) -> None:
    assert searched(monkeypatch, spans=spans, is_ephemeris=True).passes == []
    if is_known:
        assert searched(monkeypatch, spans=spans).passes == []
    else:
        with pytest.raises(Exception, match="SCD: the search lies outside what is known of it"):
            searched(monkeypatch, spans=spans)


# A picture


class SkyTrack(NamedTuple):
    label: str
    tai_s: Any
    az_deg: Any
    el_deg: Any


class Drawn:
    """Stands for the drawing: remembers the tracks."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.given: list[Any] = []
        self.error: OSError | None = None
        module: Any = ModuleType("sky_plot")  # the real one loads matplotlib
        module.plot_sky, module.SkyTrack = self._draw, SkyTrack
        monkeypatch.setitem(sys.modules, "acu_daemon.report.sky_plot", module)
        look = SimpleNamespace(az_deg=[1.0], el_deg=[2.0])
        monkeypatch.setattr(coming_passes, "apparent_at", lambda propagator, tai_s, site: look)

    def _draw(self, *given: Any) -> None:
        self.given = list(given)
        if self.error is not None:
            raise self.error


def test_the_first_twelve_passes_are_drawn_with_name_and_time(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = Drawn(monkeypatch)
    ones = [replace(ONE, rise_tai_s=RISE + 600.0 * k) for k in range(8)]
    others = [replace(ONE, rise_tai_s=RISE + 600.0 * k + 60.0) for k in range(8)]
    found = {"b": seen(*others), "a": seen(*ones)}
    found = {name: replace(of, propagators=dict.fromkeys(of.passes, "p")) for name, of in found.items()}  # type: ignore[arg-type]
    about = SimpleNamespace(name="Cuiaba", min_elevation_deg=7.0)
    station: Any = SimpleNamespace(site="here", bounds="bounds", station=about)
    coming_passes._plot(Path("x.png"), station, found)
    path, bounds, tracks, lowest_deg, title = drawn.given
    assert (path, bounds, lowest_deg, title) == (Path("x.png"), "bounds", 7.0, "The sky over Cuiaba")
    assert len(tracks) == 12
    assert [one.label for one in tracks[:3]] == ["a 03-01 13:00", "b 03-01 13:01", "a 03-01 13:10"]
    first = tracks[0]
    assert (first.tai_s[0], first.tai_s[-1], len(first.tai_s)) == (ONE.rise_tai_s, ONE.set_tai_s, 200)
    assert (first.az_deg, first.el_deg) == ([1.0], [2.0])
    drawn.error = OSError(28, "No space left on device")
    with pytest.raises(UsageError, match=r"--plot x\.png: No space left on device"):
        coming_passes._plot(Path("x.png"), station, found)

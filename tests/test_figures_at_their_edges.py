"""Figures of a report at their edges: what is cut, counted, picked of many, and what is said where nothing is known."""

from dataclasses import replace
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from matplotlib.figure import Figure
from test_every_figure_of_a_report import COMING, RISE, TARGET, reading, watched

from acu_daemon.assist.session.estimator_comparison import Comparison, Errors
from acu_daemon.cli.run_setup import make_job
from acu_daemon.control.orders import Event
from acu_daemon.model import Correction, FitResult
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.report import comparison_table
from acu_daemon.report.json_numbers import MOST_POINTS, all_rounded, few, rounded
from acu_daemon.report.pass_figures import pass_figures
from acu_daemon.report.pass_watch import PassWatch

NO_LINE: Any = SimpleNamespace(byte_time_s=0.0)
JOB = make_job(TARGET, COMING, NO_LINE, is_rehearsal=True)
WITHOUT = make_job(TARGET, None, NO_LINE, is_rehearsal=False)


def made(job: Any = JOB, *, is_whole: bool = True, **changes: Any) -> dict[str, Any]:
    watch = replace(watched(), **changes)
    return pass_figures(job, TARGET.station, TARGET.satellite, watch, is_whole=is_whole)


def at(seconds: float) -> str:
    return utc_text(RISE + seconds, 1)


def test_a_report_says_what_it_is_about() -> None:
    about, source, site = made(is_whole=False)["pass"], JOB.refit.propagator, JOB.refit.site.station
    assert about == {
        "satellite": JOB.satellite,
        "norad_id": TARGET.satellite.satellite.norad_id,
        "station": site.name,
        "latitude_deg": site.latitude_deg,
        "longitude_deg": site.longitude_deg,
        "height_m": site.height_m,
        "elements": source.kind,
        "elements_epoch_utc": utc_text(source.epoch_tai_s, 0),
        "elements_age_days": round((RISE - source.epoch_tai_s) / 86400.0, 2),
        "estimator": JOB.refit.estimator,
        "beamwidth_deg": JOB.control.beamwidth_deg,
        "is_rehearsal": True,
        "is_shadow": JOB.control.is_shadow,
        "is_recording_whole": False,
    }
    other = made(WITHOUT)
    assert (other["pass"]["elements_age_days"], other["pass"]["is_rehearsal"], other["plan"]) == (0.0, False, None)
    assert made()["format"] == 1


def test_without_anything_seen_nothing_is_known_and_nothing_fails() -> None:
    empty = pass_figures(JOB, TARGET.station, TARGET.satellite, PassWatch(), is_whole=True)
    assert set(empty["outcome"].values()) == {None, 0}
    assert (empty["states"], empty["losses"], empty["curves"], empty["limited"]) == ([], [], {}, {})
    assert empty["gate"] == {"left_out": {}, "reset_count": 0}
    assert empty["latency"] == {"exchange_count": 0, "unanswered_count": 0}
    assert empty["ticks"] == {"count": 0, "left_out_count": 0, "longest_gap_s": None}
    assert (empty["schedule"], empty["hooks"], empty["correction"], empty["biases"]) == (None, [], None, [])
    assert empty["plan"]["came_highest_utc"] is None
    assert empty["plan"]["beyond_reach"] == []


@pytest.mark.parametrize(("before_s", "count"), [(901.0, 60), (900.0, 61), (0.0, 61)])
def test_of_a_long_wait_the_last_quarter_of_an_hour_before_the_rise_is_left(before_s: float, count: int) -> None:
    early = replace(reading(0), tai_s=RISE - before_s, az_deg=1.0, is_acquired=False)
    curve = made(readings=[early, *watched().readings])["curves"]
    assert len(curve["path"]["t_s"]) == count
    zero_s = -before_s if count == 61 else -1.0
    assert curve["zero_utc"] == utc_text(RISE + zero_s, 3)
    assert curve["rise_t_s"] == -zero_s


@pytest.mark.parametrize(
    ("gaps_s", "left_out", "longest_s"),
    [((0.1, 0.1), 0, 0.1), ((0.149, 0.1), 0, 0.149), ((0.151, 0.1), 1, 0.151), ((0.3, 0.2), 3, 0.3), ((1.0,), 9, 1.0)],
)
def test_a_gap_of_more_than_one_and_a_half_periods_is_of_ticks_that_were_left_out(
    gaps_s: tuple[float, ...], left_out: int, longest_s: float
) -> None:
    times = [RISE + one for one in np.cumsum((0.0, *gaps_s)).tolist()]
    assert made(ticks_tai_s=times)["ticks"] == {
        "count": len(times),
        "left_out_count": left_out,
        "longest_gap_s": pytest.approx(longest_s),
    }


@pytest.mark.parametrize(("end_s", "set_s", "lost_s"), [(9.0, 900.0, 6.0), (9.0, 7.0, 4.0), (9.0, 2.0, 0.0)])
def test_lost_at_the_end_is_until_the_set_or_the_end_of_the_recording(
    end_s: float, set_s: float, lost_s: float
) -> None:
    held, lost = reading(25), reading(35)
    readings = [replace(held, tai_s=RISE + one) for one in (1.0, 2.0)]
    readings += [replace(lost, tai_s=RISE + one) for one in (3.0, 5.0, end_s)]
    job = replace(JOB, coming=replace(COMING, set_tai_s=RISE + set_s))
    outcome = made(job, readings=readings)["outcome"]
    assert (outcome["lost_at_end_s"], outcome["lost_s"], outcome["loss_count"]) == (lost_s, 0.0, 1)
    assert made(WITHOUT, readings=readings)["outcome"]["lost_at_end_s"] == 6.0


def test_the_highest_is_of_the_pass_alone() -> None:
    low, high = replace(reading(30), el_deg=5.0), replace(reading(40), el_deg=44.444)
    around = [replace(reading(0), tai_s=COMING.rise_tai_s - 1.0, el_deg=80.0)]
    around += [low, high, replace(low, tai_s=high.tai_s + 1.0)]
    around += [replace(reading(50), tai_s=COMING.set_tai_s + 1.0, el_deg=85.0)]
    plan = made(readings=around)["plan"]
    assert (plan["came_highest_utc"], plan["came_highest_el_deg"]) == (at(3.0), 44.44)


def test_warnings_are_told_once_with_their_count_in_their_order() -> None:
    def warning(name: str, **fields: Any) -> Event:
        return Event(name, fields, is_warning=True)

    events = [
        (RISE + 1.0, warning("b", x=1.23456, y="z")),
        (RISE + 2.0, Event("a", {"x": 1})),
        (RISE + 3.0, warning("state.changed", x=1)),
        (RISE + 4.0, warning("a")),
        (RISE + 5.0, warning("b", x=1.23461, y="z")),  # the same to four digits
        (RISE + 6.0, warning("b", x=2, y="z")),
    ]
    assert made(events=events)["events"] == [
        {"utc": at(1.0), "name": "b", "said": "x 1.235, y z", "count": 2},
        {"utc": at(4.0), "name": "a", "said": "", "count": 1},
        {"utc": at(6.0), "name": "b", "said": "x 2, y z", "count": 1},
    ]


def test_notes_of_the_line_have_their_words_and_facts_stand_elsewhere() -> None:
    notes: list[Any] = [
        (0.0, ("L", "refused")),
        (RISE, ("L", "")),
        (RISE, ("C", "")),
        (RISE, ("E", "elements")),
        (RISE, ("I", "hook", {"name": "a"})),
        (RISE, ("I", "schedule", {"state": "done"})),
        (RISE, ("I", "hook", {"name": "b"})),
        (RISE, ("I", "schedule", {"state": "later"})),
    ]
    found = made(notes=notes)
    assert found["line"] == [
        {"utc": None, "what": "line", "text": "refused"},
        {"utc": at(0.0), "what": "line", "text": "open"},
        {"utc": at(0.0), "what": "clock", "text": "good again"},
    ]
    assert found["hooks"] == [{"name": "a"}, {"name": "b"}]
    assert found["schedule"] == {"state": "done"}


def test_of_many_readings_the_worst_of_each_group_are_drawn() -> None:
    one = reading(0)
    many = [
        replace(one, tai_s=RISE + 0.1 * k, off_path_deg=0.001 * (k % 3), az_deg=float(k))
        for k in range(3 * MOST_POINTS)
    ]
    many[7] = replace(many[7], off_path_deg=9.0)
    late = [(RISE + 0.1 * k, 0.001 * (k % 2)) for k in range(1000)]
    curves = made(readings=many, latencies_s=late)["curves"]
    assert len(curves["path"]["t_s"]) == len(curves["off_path"]["beamwidths"]) == MOST_POINTS == 500
    assert curves["path"]["az_deg"][:4] == [2.0, 5.0, 7.0, 11.0]
    assert curves["off_path"]["beamwidths"][2] == 4.5
    assert set(curves["latency"]["ms"]) == {1.0}
    assert len(curves["latency"]["ms"]) == 500
    assert curves["path"]["t_s"][0] == 0.2


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [(None, 2, None), (nan, 2, None), (inf, 2, None), (1.005001, 2, 1.01), (-0.001, 2, 0.0)],
)
def test_a_number_is_rounded_and_what_is_not_finite_is_not_known(
    value: float | None, digits: int, shown: float | None
) -> None:
    assert rounded(value, digits) == shown
    assert str(rounded(-0.001, 2)) == "0.0"
    assert all_rounded(np.array([1.26, nan]), 1) == [1.3, None]


@pytest.mark.parametrize("count", [0, 1, 2, 499, 500, 501, 7777])
def test_a_few_points_are_evenly_spread_with_both_ends(count: int) -> None:
    some = few(count)
    assert some.size == min(count, MOST_POINTS)
    assert some[[0, -1]].tolist() == [0, count - 1] if count else some.size == 0
    assert np.ptp(np.diff(some)) <= 1 if count > 1 else True


# Estimators side by side

T0 = tai_from_utc("2026-12-31T23:59:50Z")
FIT = FitResult("a", Correction(), 0.0, 9, 0, 0.0, along_s=0.0, across_deg=-0.01)


class Kept(Figure):
    """A figure that is looked at and written nowhere."""

    newest: ClassVar["Kept"]

    def savefig(self, fname: Any, **kwargs: Any) -> None:
        Kept.newest = self


def compared(**changes: Any) -> Comparison:
    t = T0 + np.arange(100.0)
    errors = {"a": Errors(t, np.linspace(0.0, 0.099, 100)), "b": Errors(t[:0], t[:0])}
    tracked = {"a": Errors(t[:2], np.array([1.0, 2.0])), "b": Errors(t[:0], t[:0])}
    given = Comparison(False, errors, {"a": FIT, "b": None}, {"a": {}, "b": {}}, tracked)
    return replace(given, **changes)


def test_a_table_has_median_95_percent_worst_and_last_fit_of_each() -> None:
    errors = compared().errors | {"a": Errors(T0 + np.arange(101.0), np.linspace(0.0, 0.2, 101))}
    lines = comparison_table.table(compared(errors=errors), {"a": 1.234, "b": 5.0})
    assert lines[3].split() == [
        "a",
        "0.1000",
        "0.1900",
        "0.2000",
        *["0.000", "s", "late,", "-0.0100", "deg", "across", "1.23"],
    ]
    assert lines[4].split() == ["b", "-", "-", "-", "none", "5.00"]
    assert lines[2].split()[:3] == ["estimator", "median", "deg"]


def test_a_comparison_says_what_is_not_compared() -> None:
    said = comparison_table.what_is_compared
    assert said(compared()).startswith("Prediction up to a second ahead against 100 locked readings")
    assert "Not compared" not in said(compared())
    strays = "Not compared: 3 without lock while the antenna stood, or moved unlike the path."
    assert said(compared(stray_count=3)).endswith(strays)
    assert said(compared(is_held_back=True)).startswith("Prediction against 100 readings without lock, held back")
    nothing = compared(errors={"b": compared().errors["b"]}, stray_count=2)
    assert said(nothing).startswith("Nothing to compare: ")
    assert "Not compared: 2 " in said(nothing)


@pytest.mark.parametrize("is_held_back", [False, True])
def test_errors_are_drawn_over_utc_with_forty_medians_and_a_floor(
    is_held_back: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparison_table, "Figure", Kept)
    spans = [(T0, T0 + 1.0), (T0 + 5.0, T0 + 8.0)]
    seen = compared(is_held_back=is_held_back, losses_tai_s=spans, gaps_tai_s=spans[:1])
    comparison_table.plot(Path("nowhere.png"), seen, "title")
    [axes] = Kept.newest.get_axes()
    dots, medians, *more = axes.get_lines()
    assert len(more) == (2 if is_held_back else 0)
    assert np.asarray(dots.get_ydata()).tolist() == pytest.approx([1e-4, *(0.001 * k for k in range(1, 100))])
    midnight = np.datetime64("2027-01-01").astype("datetime64[D]").astype(float)
    assert np.asarray(dots.get_xdata())[[0, 10]] == pytest.approx([midnight - 10.0 / 86400.0, midnight], abs=1e-9)
    assert np.asarray(medians.get_ydata()).size == 40
    assert np.asarray(medians.get_ydata())[:2] == pytest.approx([0.001, 0.004])
    assert [one.get_width() * 86400.0 for one in axes.patches] == pytest.approx([1.0, 3.0, 1.0], abs=1e-3)
    assert [text.get_text() for text in Kept.newest.legends[0].get_texts()] == [
        *("no signal", "no readings: the daemon was stopped", "a")
    ]
    nothing = {name: Errors(T0 + np.zeros(0), np.zeros(0)) for name in ("a", "b")}
    comparison_table.plot(Path("nowhere.png"), compared(errors=nothing), "title")
    assert Kept.newest.legends == []

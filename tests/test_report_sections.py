"""The parts of a pass's report that are computed or drawn: residuals, biases, the curves of a chart, what is said."""

import re
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from test_every_figure_of_a_report import COMING, RISE, TARGET, figures, watched

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.cli.run_setup import make_job
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.errors import OrbitError
from acu_daemon.model import AngleBias, Correction, FitResult, Readings
from acu_daemon.orbit.look import Look
from acu_daemon.report import fit_figures, pass_sections
from acu_daemon.report.fit_figures import biases, correction, residuals
from acu_daemon.report.pass_watch import SeenFit
from acu_daemon.units import DEG

JOB = make_job(TARGET, COMING, type("Line", (), {"byte_time_s": 0.0})(), is_rehearsal=True)
FIT = FitResult("full", Correction(), RISE, 9, 0, 0.01, 0.0, 0.0)

ALONG_DEG = 0.005  # what is interpolated between readings 5 s apart differs by less

# Residuals


def look(az_deg: list[float], el_deg: list[float]) -> Look:
    nothing = np.zeros(len(az_deg))
    return Look(np.array(az_deg), np.array(el_deg), nothing, nothing, nothing)


def given(az_deg: list[float], el_deg: list[float]) -> Readings:
    return Readings(RISE + np.arange(len(az_deg)), np.array(az_deg), np.array(el_deg))


def test_residuals_are_readings_less_what_is_expected_across_by_the_cosine_of_the_elevation() -> None:
    found = fit_figures._residuals_of(
        given([10.2, 20.0, 30.0], [60.0, 60.5, 60.0]), RISE - 2.0, look([10.0, 20.0, 30.1], [60.0, 60.0, 60.2])
    )
    assert found["curve"] == {
        "t_s": [2.0, 3.0, 4.0],
        "cross_elevation_deg": [0.1, 0.0, pytest.approx(-0.1 * np.cos(np.radians(60.2)), abs=5e-5)],
        "elevation_deg": [0.0, 0.5, -0.2],
    }
    assert found["mean_elevation_deg"] == 0.1
    across = [0.1, 0.0, -0.1 * np.cos(np.radians(60.2))]
    assert found["mean_cross_elevation_deg"] == pytest.approx(sum(across) / 3.0, abs=5e-5)
    assert found["largest_deg"] == 0.5
    squares = sum(one**2 for one in (*across, 0.5, 0.2))
    assert found["rms_deg"] == pytest.approx(np.sqrt(squares / 3.0), abs=5e-5)


@pytest.mark.parametrize(("az_deg", "expected_deg"), [(359.9, 0.1), (0.1, 359.9), (-180.1, 179.7), (540.0, 180.2)])
def test_an_azimuth_over_north_or_on_another_turn_is_near(az_deg: float, expected_deg: float) -> None:
    off_deg = fit_figures._residuals_of(given([az_deg], [0.0]), RISE, look([expected_deg], [0.0]))
    assert abs(off_deg["mean_cross_elevation_deg"]) == 0.2


def watched_with(readings: list[Readings]) -> Any:
    watch = watched()
    watch.fitted_readings = readings
    return watch


def readings_on_the_path(bias_deg: tuple[float, float]) -> Readings:
    tai_s = RISE + 60.0 + 5.0 * np.arange(12)
    seen = encoder_look(JOB.refit.propagator, tai_s, JOB.refit.site, None)
    return Readings(tai_s, seen.az_deg + bias_deg[0], seen.el_deg + bias_deg[1])


def test_residuals_are_against_the_elements_and_against_the_last_fit_with_its_biases() -> None:
    one = readings_on_the_path((0.0, 0.3))
    watch = watched_with([one.part(slice(0, 6)), one.part(slice(6, None))])
    fit = FitResult("full", Correction(), RISE, 9, 0, 0.0, 0.0, 0.0, AngleBias(el_deg=0.3))
    found = residuals(JOB, watch, fit)
    assert found["reading_count"] == 12
    assert found["before"]["mean_elevation_deg"] == 0.3
    assert found["before"]["rms_deg"] == 0.3
    assert found["after"]["rms_deg"] == pytest.approx(0.0, abs=ALONG_DEG)
    for one in (found["before"], found["after"]):
        assert one["curve"]["t_s"][0] == 61.0  # from the first reading of all on


def test_what_the_fit_moved_is_in_the_residuals_after_it() -> None:
    one = readings_on_the_path((0.0, 0.0))
    moved = FitResult("full", Correction(0.0, 0.2 * DEG), RISE, 9, 0, 0.0, 0.0, 0.0)
    found = residuals(JOB, watched_with([one]), moved)
    assert found["before"]["rms_deg"] == 0.0
    assert found["after"]["rms_deg"] > 0.05


def test_without_a_fit_or_without_readings_there_are_fewer() -> None:
    one = readings_on_the_path((0.1, 0.0))
    found = residuals(JOB, watched_with([one]), None)
    assert found["before"] is not None
    assert found["after"] is None
    for nothing in ([], [one.part(slice(0, 0))]):
        assert residuals(JOB, watched_with(nothing), FIT) == {"reading_count": 0, "before": None, "after": None}


def test_times_at_which_there_is_no_position_have_none(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> Look:
        raise OrbitError("decayed")

    monkeypatch.setattr(fit_figures, "encoder_look", fail)
    found = residuals(JOB, watched_with([readings_on_the_path((0.0, 0.0))]), FIT)
    assert found == {"reading_count": 12, "before": None, "after": None}


# The correction


def test_a_fit_without_a_spread_or_a_covariance_has_no_sigmas() -> None:
    watch = watched()
    watch.fits = [SeenFit(RISE, FIT, (9.0, 9.0)), SeenFit(RISE, FIT, None)]
    found = correction(watch, FIT)
    assert found is not None
    assert found["fit_count"] == 2
    assert [key for key, value in found.items() if value is None] == [
        "along_sigma_s",
        "across_sigma_deg",
        "raan_sigma_deg",
        "mean_anomaly_sigma_deg",
        "inclination_sigma_deg",
    ]
    assert correction(watch, None) is None


def with_covariance(**variances_deg2: float) -> FitResult:
    diagonal = np.zeros(17)
    for name, variance in variances_deg2.items():
        diagonal[int(name[1:])] = variance * DEG**2
    return FitResult(
        "full", Correction(), RISE, 9, 0, 0.0, 0.0, 0.0, AngleBias(el_deg=0.2), covariance=np.diag(diagonal)
    )


def test_a_bias_is_told_where_it_is_moved_or_may_be() -> None:
    assert biases(None) == []
    assert biases(FIT) == []
    assert biases(with_covariance()) == [{"name": "el_deg", "value_deg": 0.2, "sigma_deg": 0.0}]
    found = biases(with_covariance(s6=0.01, s8=0.04, s16=-1e-9))
    assert found == [
        {"name": "az_deg", "value_deg": 0.0, "sigma_deg": 0.1},
        {"name": "el_deg", "value_deg": 0.2, "sigma_deg": 0.2},
    ]
    value = FitResult("full", Correction(), RISE, 9, 0, 0.0, 0.0, 0.0, AngleBias(tf_deg=-0.1))
    assert biases(value) == [{"name": "tf_deg", "value_deg": -0.1, "sigma_deg": None}]


# What is drawn


class Charts:
    """Stands for the drawing: remembers what each chart was given."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.drawn: dict[str, tuple[str, list[Any], dict[str, Any]]] = {}
        monkeypatch.setattr(pass_sections, "chart", self._draw)

    def _draw(self, title: str, unit: str, lines: list[Any], **more: Any) -> str:
        self.drawn[title] = unit, lines, more
        return f"[{title}]"


@pytest.fixture
def charts(monkeypatch: pytest.MonkeyPatch) -> Charts:
    return Charts(monkeypatch)


def changed(**parts: Any) -> dict[str, Any]:
    return deepcopy(figures()) | parts


@pytest.mark.parametrize("state", list(TrackState))
def test_a_band_has_the_colour_of_its_state(state: TrackState) -> None:
    kind = "other"
    if state in ("AUTOTRACK/TLE", "AUTOTRACK/FITTED"):
        kind = "auto"
    elif state in ("HOLD/TLE", "HOLD/FITTED", "ZENITH"):
        kind = "hold"
    elif state == "SEARCH":
        kind = "search"
    assert pass_sections._kind(str(state)) == kind


def test_the_curves_begin_at_their_second_of_the_day() -> None:
    assert pass_sections._zero_s({"curves": {"zero_utc": "2026-08-18T12:44:11.4Z"}}) == 12 * 3600 + 44 * 60 + 11.4


def test_what_is_farther_than_three_beamwidths_is_not_drawn() -> None:
    assert pass_sections._held([None, 0.0, 3.0, 3.01]) == [None, 0.0, 3.0, None]
    assert pass_sections._times([None, 0.0, 1.0, 1.01], 3.0) == [None, 0.0, 3.0, None]


def test_the_course_is_drawn_with_its_states_over_the_whole_pass(charts: Charts) -> None:
    made = figures()
    page = pass_sections.course_section(made)
    assert list(charts.drawn) == ["Distance from the path in beamwidths", "Elevation", "Signal level"]
    assert re.findall(r"\[(.*?)\]", page) == list(charts.drawn)
    curves = made["curves"]
    for _, _, more in charts.drawn.values():
        assert more["span_s"] == (curves["path"]["t_s"][0], curves["path"]["t_s"][-1])
        assert more["zero_s_of_day"] == pass_sections._zero_s(made)
        bands = [(one.from_s, one.to_s, one.kind, one.label) for one in more["bands"]]
        assert bands == [
            (0.0, 2.0, "other", "PREPOSITION, 2.0 s"),
            (2.0, 3.0, "auto", "AUTOTRACK/FITTED, 1.0 s"),
            (3.0, 4.5, "hold", "HOLD/FITTED, 1.5 s"),
            (4.5, 6.0, "auto", "AUTOTRACK/FITTED, 1.5 s"),
        ]
    unit, (sigma, off), more = charts.drawn["Distance from the path in beamwidths"]
    assert (unit, more["from_zero"], more["marks"]) == ("beamwidths off the path", True, [(0.5, "half the beam")])
    assert (sigma.kind, off.kind) == ("b", "a")
    assert sigma.t_s is off.t_s is curves["off_path"]["t_s"]
    assert off.values == pass_sections._held(curves["off_path"]["beamwidths"])
    assert sigma.values == pass_sections._times(curves["off_path"]["sigma_beamwidths"], 3.0)
    _, (elevation,), _ = charts.drawn["Elevation"]
    assert (elevation.t_s, elevation.values) == (curves["path"]["t_s"], curves["path"]["el_deg"])
    _, (level,), _ = charts.drawn["Signal level"]
    assert (level.t_s, level.values) == (curves["level"]["t_s"], curves["level"]["db"])
    assert "<td>AUTOTRACK/FITTED</td>" in page


def test_without_curves_or_without_a_level_less_is_drawn(charts: Charts) -> None:
    assert pass_sections.course_section(changed(curves={})) == ""
    made = changed()
    made["curves"]["level"]["db"] = [None] * len(made["curves"]["level"]["db"])
    pass_sections.course_section(made)
    assert "Signal level" not in charts.drawn


def residual(first: float) -> dict[str, Any]:
    names = ("rms_deg", "largest_deg", "mean_cross_elevation_deg", "mean_elevation_deg")
    curve = {"t_s": [1.0, 2.0], "cross_elevation_deg": [first, 0.0], "elevation_deg": [0.0, first]}
    return {name: round(first + 0.01 * k, 2) for k, name in enumerate(names)} | {"curve": curve}


def rows_of(page: str) -> list[list[str]]:
    rows = (re.findall(r"<td[^>]*>(.*?)</td>", line) for line in re.findall(r"<tr>(.*?)</tr>", page))
    return [row for row in rows if row]


def test_residuals_are_drawn_and_told_before_and_after(charts: Charts) -> None:
    found = {"reading_count": 77, "before": residual(0.5), "after": residual(0.1)}
    page = pass_sections.residuals_section(changed(residuals=found))
    assert rows_of(page)[:2] == [
        ["against the elements", "0.5", "0.51", "0.52", "0.53"],
        ["against the last fit", "0.1", "0.11", "0.12", "0.13"],
    ]
    heads = re.findall(r"<th(?: [^>]*)?>(.*?)</th>", page)
    assert heads[:5] == ["77 readings fitted", "rms °", "largest °", "mean cross °", "mean elevation °"]
    for what, first in (("the elements", 0.5), ("the last fit", 0.1)):
        assert f"<h3>Against {what}</h3>" in page
        unit, (cross, up), more = charts.drawn[f"Residuals against {what}"]
        assert (unit, cross.kind, up.kind, cross.has_dots, up.has_dots) == ("°", "a", "b", True, True)
        assert (cross.t_s, cross.values, up.values) == ([1.0, 2.0], [first, 0.0], [0.0, first])
        assert more["span_s"] == pass_sections._span(figures()["curves"]["path"]["t_s"])
    assert rows_of(page)[2:] == [["outlier", "15"]]
    assert "gave way to newer readings 2 times" in page


def test_where_nothing_was_fitted_or_left_out_it_is_said(charts: Charts) -> None:
    nothing = {"reading_count": 0, "before": None, "after": None}
    page = pass_sections.residuals_section(changed(residuals=nothing, gate={"left_out": {}, "reset_count": 0}))
    assert "<p>No reading was fitted.</p>" in page
    assert page.endswith("<h3>Readings left out, and why</h3><p>None.</p>")
    assert charts.drawn == {}
    assert len(rows_of(pass_sections.residuals_section(changed(residuals=nothing | {"before": residual(0.5)})))) == 2


def test_the_correction_is_drawn_with_its_sigmas(charts: Charts) -> None:
    page = pass_sections.correction_section(figures())
    curve = figures()["curves"]["correction"]
    for name, unit, kind in (("along", "s", "a"), ("across", "deg", "b")):
        said, (line,), more = charts.drawn[f"Correction {name} the track"]
        assert (said, line.kind) == (f"{'s' if name == 'along' else '°'} {name}", kind)
        assert line.values == curve[f"{name}_{unit}"]
        assert (line.t_s, line.sigma) == (curve["t_s"], curve[f"{name}_sigma_{unit}"])
        assert more["span_s"] == pass_sections._span(figures()["curves"]["path"]["t_s"])
    assert ">1 fits, the last<" in page
    assert "No bias is fitted" not in page
    assert "<p>No bias is fitted.</p>" in pass_sections.correction_section(changed(biases=[]))


@pytest.mark.parametrize("part", ["correction", "curves"])
def test_where_there_was_no_fit_nothing_of_it_is_drawn(charts: Charts, part: str) -> None:
    made = changed(correction=None) if part == "correction" else changed(curves={})
    assert pass_sections.correction_section(made).endswith("<p>Nothing was fitted.</p>")
    assert charts.drawn == {}


def test_latency_is_drawn_where_anything_was_answered(charts: Charts) -> None:
    pass_sections.line_section(figures())
    unit, (line,), more = charts.drawn["Latency of the exchanges"]
    curve = figures()["curves"]["latency"]
    assert (unit, line.t_s, line.values) == ("ms, slowest of each slot", curve["t_s"], curve["ms"])
    assert more["from_zero"]
    for curves in ({}, {"latency": {"t_s": [], "ms": []}}):
        charts.drawn.clear()
        page = pass_sections.line_section(changed(curves=curves))
        assert charts.drawn == {}
        assert page.startswith('<h2>Line and commands</h2><div class="pair">')


def test_figures_of_the_line_that_are_not_known_are_dashes_and_lists_that_are_empty_say_so(charts: Charts) -> None:
    latency = {"exchange_count": 0, "unanswered_count": 3}
    page = pass_sections.line_section(changed(latency=latency, refused=[], line=[]))
    rows = {row[0]: row[1] for row in rows_of(page)}
    assert [rows[name] for name in ("latency, ms: half of them", "99 %", "slowest")] == ["–"] * 3
    assert page.count("<p>None.</p>") == 2
    assert "limited count" in rows

"""Pictures by what is put on their axes: north up, east right, what is shaded, where lines lie, what legends say."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from acu_daemon.assist.mount_memory.mount_fit import FittedPass
from acu_daemon.edge.mount_memory_file import PassRow
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.pointing.skyline import Skyline
from acu_daemon.report import pass_plan_plot, plot, sky_plot
from acu_daemon.report.mount_text import plot_drift, plot_residuals
from acu_daemon.report.pass_plan_plot import LIMIT, SUN, PlannedPicture, plot_plan
from acu_daemon.report.pass_trace import Figures, Trace, figures_table, measure, until
from acu_daemon.report.plot import FLOOR_DEG, plot_passes
from acu_daemon.report.sky_plot import SkyTrack, plot_sky

Drawn = Callable[..., Any]
AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
WHERE = Path("nowhere.png")


class Kept(Figure):
    """A figure that is looked at and written nowhere."""

    newest: ClassVar["Kept"]

    def savefig(self, fname: Any, **kwargs: Any) -> None:
        Kept.newest = self


@pytest.fixture(autouse=True)
def _kept(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (pass_plan_plot, sky_plot, plot):
        monkeypatch.setattr(module, "Figure", Kept)


def lines(axes: Axes, label: str) -> list[tuple[list[float], list[float]]]:
    found = [line for line in axes.get_lines() if line.get_label() == label]
    return [(np.asarray(line.get_xdata()).tolist(), np.asarray(line.get_ydata()).tolist()) for line in found]


def legend(axes: Axes) -> list[str]:
    return axes.get_legend_handles_labels()[1]


def is_north_up(axes: Any) -> bool:
    names = [one.get_text() for one in axes.get_xticklabels()]
    places = np.degrees(axes.get_xticks()).round().tolist()
    is_so = axes.get_theta_offset() == np.pi / 2.0 and axes.get_theta_direction() == -1
    return is_so and dict(zip(places, names, strict=True)) == {0.0: "N", 90.0: "E", 180.0: "S", 270.0: "W"}


# A planned pass


def planned(**changes: Any) -> PlannedPicture:
    """Two minutes and a half from south to north, close by the zenith; the antenna is off it in the middle."""
    seconds = np.arange(151.0)
    el = 60.0 + 29.0 * (1.0 - np.abs(seconds - 75.0) / 75.0)
    az = np.where(seconds < 75.0, 170.0, 350.0)
    off = np.where(np.abs(seconds - 75.0) < 5.0, 0.5, 0.0)
    given: dict[str, Any] = {
        "seconds": seconds, "path_az_deg": az, "path_el_deg": el, "antenna_az_deg": az + 1.0,
        "antenna_el_deg": el + 1.0,
        "off_deg": off, "sky_path_deg": (az, el), "sky_antenna_deg": (az + 0.5, el), "azimuth": AZIMUTH,
        "elevation": ELEVATION, "half_beam_deg": 0.3, "min_elevation_deg": 7.0, "hills": None, "sun_deg": None,
        "keyhole": None, "spans": (("zenith", 70.0, 80.0), ("hill", 0.0, 9.0)), "begins": "2026-01-01T00:00:00Z",
    }  # fmt: skip
    return PlannedPicture(**given | changes)


def drawn_plan(**changes: Any) -> list[Any]:
    plot_plan(WHERE, planned(**changes), "title")
    return list(Kept.newest.get_axes())


def test_a_plan_has_the_sky_the_zenith_both_axes_and_the_error() -> None:
    sky, zenith, azimuth, elevation, error = drawn_plan()
    assert is_north_up(sky)
    assert sky.get_rmax() == 90.0
    [(minutes_az, minutes_r)] = lines(sky, "each minute")
    assert np.degrees(minutes_az).tolist() == pytest.approx([170.0, 350.0])
    assert minutes_r == pytest.approx([90.0 - 60.0 - 29.0 * 0.8, 90.0 - 60.0 - 29.0 * 0.4])
    [(begin_az, begin_r)] = lines(sky, "begins")
    assert (np.degrees(begin_az[0]), begin_r[0]) == pytest.approx((170.0, 30.0))
    assert set(sky.get_lines()[0].get_ydata()) == {83.0}  # the lowest elevation
    assert (zenith.get_xlabel(), zenith.get_ylabel()) == ("east, deg", "north, deg")
    assert (azimuth.get_ylabel(), elevation.get_ylabel()) == ("azimuth, deg", "elevation, deg")
    assert error.get_xlabel() == "seconds from 2026-01-01T00:00:00Z"
    for axes, plus in ((azimuth, 0), (elevation, 1)):
        _, antenna = lines(axes, "antenna")[0]
        one = planned()
        assert antenna == pytest.approx((one.antenna_el_deg if plus else one.antenna_az_deg).tolist())
        shaded = [patch for patch in axes.patches if patch.get_facecolor()[:3] == pytest.approx(rgb(SUN), abs=0.01)]
        assert sorted((p.get_x(), p.get_width()) for p in shaded) == [(0.0, 9.0), (70.0, 10.0)]


def rgb(colour: str) -> tuple[float, ...]:
    return tuple(int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))


def test_about_the_zenith_east_is_right_and_north_is_up() -> None:
    sky_path = np.array([90.0, 90.0, 0.0, 0.0]), np.array([89.0, 89.5, 89.5, 89.0])
    seconds = np.arange(4.0)
    _, zenith, *_ = drawn_plan(
        seconds=seconds, sky_path_deg=sky_path, sky_antenna_deg=sky_path, off_deg=np.array([0.0, 0.5, 0.1, 0.0]),
        **dict.fromkeys(("path_az_deg", "path_el_deg", "antenna_az_deg", "antenna_el_deg"), seconds),
    )  # fmt: skip
    x, y = (np.asarray(values) for values in zenith.get_lines()[0].get_data())
    assert x.tolist() == pytest.approx([1.0, 0.5, 0.0, 0.0], abs=1e-9)
    assert y.tolist() == pytest.approx([0.0, 0.0, 0.5, 1.0], abs=1e-9)
    assert (zenith.get_xlim(), zenith.get_ylim()) == (pytest.approx((-2.8, 2.8)), pytest.approx((-2.0, 2.0)))
    [beam] = zenith.patches
    middle = beam.get_xy()[:-1].mean(axis=0)
    assert middle == pytest.approx([0.5, 0.0], abs=0.02)  # where it is largest
    assert np.ptp(beam.get_xy()[:, 0]) == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("changes", "has_it"),
    [
        ({}, True),
        ({"spans": ()}, False),
        ({"off_deg": np.full(151, 0.02)}, False),
        ({"off_deg": np.full(151, 0.0201)}, True),
    ],
)
def test_the_zenith_has_a_picture_where_it_is_crossed_with_a_notable_error(
    changes: dict[str, Any], has_it: bool
) -> None:
    assert len(drawn_plan(**changes)) == (5 if has_it else 4)


def test_the_reach_about_the_zenith_is_of_what_is_off() -> None:
    off = np.zeros(151)
    off[60] = 0.5
    _, zenith, *_ = drawn_plan(off_deg=off)
    reach = 1.2 * (90.0 - planned().sky_path_deg[1][60])
    assert zenith.get_ylim() == pytest.approx((-reach, reach))


@pytest.mark.parametrize(
    ("limits", "shown"),
    [
        (AxisLimits(-270.0, 421.0, 20.0, 10.0), []),
        (AxisLimits(102.0, 419.0, 20.0, 10.0), [102.0, 419.0]),
        (AxisLimits(-270.0, 270.0, 20.0, 10.0), [270.0]),
        (AxisLimits(200.0, 600.0, 20.0, 10.0), [200.0]),
    ],
)
def test_a_limit_is_drawn_where_it_is_near_and_named_once(limits: AxisLimits, shown: list[float]) -> None:
    *_, azimuth, _, _ = drawn_plan(azimuth=limits)
    levels = [line.get_ydata()[0] for line in azimuth.get_lines() if line.get_color() == LIMIT]
    assert levels == shown
    assert legend(azimuth).count("limit") == (1 if shown else 0)


def test_a_path_that_jumps_by_half_a_turn_is_not_drawn_across() -> None:
    *_, azimuth, _, _ = drawn_plan()
    _, path = lines(azimuth, "path")[0]
    assert [k for k, one in enumerate(path) if np.isnan(one)] == [75]
    steep = np.cumsum(np.full(151, 89.0))
    *_, azimuth, _, _ = drawn_plan(path_az_deg=steep)
    assert not np.isnan(lines(azimuth, "path")[0][1]).any()


@pytest.mark.parametrize(("worst", "top"), [(0.5, 10.0), (4.9, 10.0), (30.0, 60.0)])
def test_the_error_has_a_floor_half_a_beam_and_room_above(worst: float, top: float) -> None:
    *_, error = drawn_plan(off_deg=np.where(np.arange(151) == 75, worst, 0.0))
    assert error.get_ylim() == pytest.approx((1e-3, top))
    values = error.get_lines()[0].get_ydata()
    assert (min(values), max(values)) == (1e-3, worst)
    assert error.get_lines()[1].get_ydata()[0] == 0.3


@pytest.mark.parametrize(
    ("sun_deg", "is_disc", "is_star"),
    [
        (None, False, False),
        ((90.0, 30.0, 5.0), True, True),
        ((90.0, -3.0, 5.0), True, False),
        ((90.0, -5.0, 5.0), False, False),
    ],
)
def test_the_sun_is_drawn_while_any_of_its_keep_out_is_up(
    sun_deg: tuple[float, float, float] | None, is_disc: bool, is_star: bool
) -> None:
    sky = drawn_plan(sun_deg=sun_deg)[0]
    assert (len(sky.patches) > 0, "sun" in legend(sky)) == (is_disc, is_star)
    for patch in sky.patches:
        edge = patch.get_xy()
        assert np.degrees(edge[:, 0].min() + edge[:, 0].max()) / 2.0 == pytest.approx(90.0)
        assert 90.0 - (edge[:, 1].min() + edge[:, 1].max()) / 2.0 == pytest.approx(sun_deg[1] if sun_deg else 0.0)
        assert np.ptp(edge[:, 1]) == pytest.approx(10.0)


def test_hills_and_a_keyhole_are_in_the_legend_where_there_are_any() -> None:
    around = np.arange(0.0, 361.0, 10.0)
    sky = drawn_plan(hills=(around, around * 0.0 + 8.0), keyhole=(around, around * 0.0 + 88.0))[0]
    assert {"mask", "keyhole"} <= set(legend(sky))
    assert sky.patches[0].get_xy()[:, 1].tolist() == pytest.approx([2.0] * len(sky.patches[0].get_xy()))
    assert not {"mask", "keyhole"} & set(legend(drawn_plan()[0]))


# The sky of a station


def drawn_sky(envelope: Envelope, *tracks: SkyTrack, lowest_deg: float = 5.0) -> Any:
    plot_sky(WHERE, envelope, tracks, lowest_deg, "title")
    [axes] = Kept.newest.get_axes()
    return axes


def reach(collection: Any) -> tuple[float, float, float, float]:
    corners = collection.get_paths()[0].vertices
    (az_low, r_low), (az_high, r_high) = corners.min(axis=0), corners.max(axis=0)
    return np.degrees(az_low), np.degrees(az_high), 90.0 - r_high, 90.0 - r_low


TRACK = SkyTrack("A", np.array([0.0, 1.0, 2.0]), np.array([350.0, 0.0, 10.0]), np.array([10.0, 40.0, 12.0]))


def test_the_sky_has_its_passes_its_ground_and_its_zones() -> None:
    zone = KeepOut("the mast", 350.0, 10.0, -20.0, 30.0)
    axes = drawn_sky(Envelope(AZIMUTH, ELEVATION, keep_outs=(zone,)), TRACK, replace(TRACK, label="B"))
    assert is_north_up(axes)
    assert axes.get_rmax() == 95.0
    assert set(legend(axes)) == {"below 5°", "the mast", "A", "B"}
    [(az, r)] = lines(axes, "A")
    assert (np.degrees(az).tolist(), r) == (pytest.approx([350.0, 0.0, 10.0]), [80.0, 50.0, 78.0])
    ground, mast = axes.collections
    assert reach(ground) == pytest.approx((0.0, 360.0, -5.0, 5.0))
    assert reach(mast) == pytest.approx((350.0, 370.0, -5.0, 30.0))


def test_a_ground_is_the_higher_of_the_mask_and_the_lowest_elevation() -> None:
    bare = Envelope(AZIMUTH, ELEVATION)
    for height_deg, lowest_deg, top_deg in ((3.0, 5.0, 5.0), (9.0, 5.0, 9.0), (3.0, 0.0, 3.0)):
        axes = drawn_sky(replace(bare, skyline=Skyline((0.0,), (height_deg,))), lowest_deg=lowest_deg)
        assert legend(axes) == [f"behind the mask, or below {lowest_deg:g}°"]
        assert reach(axes.collections[0])[3] == pytest.approx(top_deg)


def test_a_zone_all_around_is_a_whole_turn() -> None:
    axes = drawn_sky(Envelope(AZIMUTH, ELEVATION, keep_outs=(KeepOut("low", 0.0, 0.0, -90.0, 8.0),)))
    low, high, bottom, top = reach(axes.collections[1])
    assert (high - low, bottom, top) == pytest.approx((360.0, -5.0, 8.0))


# The memory of the mount


def test_the_drift_of_both_zero_points_is_drawn_over_time_with_its_sigmas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("matplotlib.figure.Figure", Kept)
    rows = [PassRow(f"2026-08-0{k}T12:00:00Z", "S", 0.1 * k, -0.2 * k, 0.01, 0.03) for k in (1, 2, 3)]
    plot_drift(WHERE, rows, "title")
    azimuth, elevation = Kept.newest.get_axes()
    for axes, name, values, sigma in (
        (azimuth, "IA", [0.1, 0.2, 0.3], 0.01),
        (elevation, "IE", [-0.2, -0.4, -0.6], 0.03),
    ):
        assert axes.get_ylabel() == f"{name}, deg"
        line = axes.get_lines()[0]
        assert np.asarray(line.get_ydata()).tolist() == pytest.approx(values)
        assert np.diff(np.asarray(axes.convert_xunits(line.get_xdata()))).tolist() == [1.0, 1.0]
        bars = axes.collections[0].get_segments()
        assert [float(np.ptp(bar[:, 1])) for bar in bars] == pytest.approx([2.0 * sigma] * 3)


def test_what_is_left_is_drawn_over_both_angles_before_and_after(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("matplotlib.figure.Figure", Kept)
    before, after = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[0.1, 0.2], [0.3, 0.4]])
    fitted = [FittedPass(f"{k}", "", np.array([k, 20.0]), np.array([30.0, k]), k * before, k * after) for k in (1, 2)]
    plot_residuals(WHERE, fitted, "title")
    across_az, across_el, up_az, up_el = Kept.newest.get_axes()
    for axes, at, row in (
        *((across_az, [1.0, 20.0, 2.0, 20.0], 0), (across_el, [30.0, 1.0, 30.0, 2.0], 0)),
        *((up_az, [1.0, 20.0, 2.0, 20.0], 1), (up_el, [30.0, 1.0, 30.0, 2.0], 1)),
    ):
        for label, left in (("before", before), ("after", after)):
            assert lines(axes, label) == [(at, pytest.approx([*left[row], *(2.0 * left[row])]))]
    assert (across_az.get_ylabel(), up_az.get_ylabel()) == ("across, deg", "elevation, deg")
    assert (up_az.get_xlabel(), up_el.get_xlabel()) == ("azimuth, deg", "elevation, deg")


# A simulated pass


def trace(**changes: Any) -> Trace:
    count = 60
    ones, ramp = np.ones(count), np.linspace(20.0, 65.0, count)
    mode = ["ACQUIRE"] * 10 + ["AUTOTRACK"] * 20 + ["RATE_MEMORY"] * 10 + ["AUTOTRACK"] * 20
    made = Trace(1000.0 + np.arange(count), ramp + 1.0, ramp, ramp, ramp, 0.1 * ones, mode, ones, ones.copy())
    return replace(made, **changes)


def test_a_pass_has_sky_error_and_modes_in_seconds_from_the_first_trace() -> None:
    off = np.ones(60)
    off[20:30] = 0.0
    error = np.full(60, 0.1)
    error[:2] = 0.0, np.nan
    later = trace(tai_s=1005.0 + np.arange(60))
    plot_passes(WHERE, {"with": trace(is_on_air=off, error_deg=error), "without": later}, 1.0, "title")
    sky, errors, modes = Kept.newest.get_axes()
    assert is_north_up(sky)
    assert sky.get_rmax() == 70.0  # down to 20 deg
    [(az, r)] = lines(sky, "with")
    assert (np.degrees(az[0]), r[0]) == pytest.approx((21.0, 70.0))
    assert np.degrees(lines(sky, "satellite")[0][0][0]) == pytest.approx(20.0)
    [(seconds, shown)] = lines(errors, "with")
    assert (seconds[0], seconds[-1], shown[0], shown[2]) == (0.0, 59.0, FLOOR_DEG, 0.1)
    assert np.isnan(shown[1])
    assert lines(errors, "without")[0][0][0] == 5.0
    assert lines(errors, "half-power beam")[0][1][0] == 0.5
    [silent] = [patch for patch in errors.patches if patch.get_label() == "no signal (scenario)"]
    assert (silent.get_x(), silent.get_width()) == (20.0, 10.0)
    bars = [(one.get_x(), one.get_width(), round(one.get_y() + 0.35)) for one in modes.patches]
    spans = (0.0, 10.0), (10.0, 20.0), (30.0, 10.0), (40.0, 19.0)
    assert sorted(bars) == sorted((begin - 5.0 * row, wide, row) for begin, wide in spans for row in (0, -1))
    assert sorted(legend(modes)) == ["acquire", "autotrack", "rate memory"]
    assert [text.get_text() for text in modes.texts] == ["with", "without"]


@pytest.mark.parametrize(("after_s", "count"), [(-1.0, 0), (0.0, 1), (0.5, 1), (10.0, 11), (59.0, 60), (99.0, 60)])
def test_a_trace_is_cut_after_an_instant(after_s: float, count: int) -> None:
    cut = until(trace(), 1000.0 + after_s)
    assert [len(part) for part in (cut.tai_s, cut.az_deg, cut.mode, cut.is_on_air)] == [count] * 4


def test_figures_of_a_pass_stand_under_their_labels() -> None:
    one = Figures(100.0, 90.04, 80.0, 7.0, 3.25, 1.234, 0.0456, is_on_satellite_at_end=True)
    table = figures_table({"with": one, "without": replace(one, worst_deg=45.6, is_on_satellite_at_end=False)})
    assert table[0] == f"{'SIMULATION':36}{'with':>16}{'without':>16}"
    assert [(line[:36].strip(), *line[36:].rsplit(maxsplit=1)) for line in table[2:]] == [
        ("signal received, s", "            80.0", "80.0"),
        ("no signal by the scenario, s", "             7.0", "7.0"),
        ("longest time off the satellite, s", "             3.2", "3.2"),
        ("median beam error, deg", "           0.046", "0.046"),
        ("largest beam error, deg", "            1.23", "45.60"),
        ("on the satellite at the end", "             yes", "no"),
    ]
    assert table[1] == f"{'beam on the satellite, s':36}" + f"{'90.0 of 100.0':>16}" * 2


@pytest.mark.parametrize(("error_deg", "is_off"), [(0.5 - 1e-9, False), (0.5, True), (0.5 + 1e-9, True)])
def test_half_the_beam_is_off_the_satellite(error_deg: float, is_off: bool) -> None:
    errors = np.full(60, 0.1)
    errors[[5, 6, 7, 20, 21, 59]] = error_deg
    figures = measure(trace(error_deg=errors, is_acquired=np.arange(60.0) >= 6.0), 1.0)
    assert figures.longest_off_s == (2.0 if is_off else 0.0)
    assert figures.seconds == 54.0
    assert figures.seconds_on_satellite == (49.0 if is_off else 54.0)
    assert figures.is_on_satellite_at_end is not is_off

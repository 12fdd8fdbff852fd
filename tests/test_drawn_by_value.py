"""Charts of a report by value: where each time and value lies on the paper, what is clipped, what each label says."""

import re
from collections.abc import Sequence
from typing import Any

import pytest

from acu_daemon.report.svg_chart import (
    BOTTOM,
    GAP_S,
    LEFT,
    MOST_TICKS,
    RIGHT,
    TOP,
    WIDTH,
    ChartBand,
    ChartFrame,
    ChartLine,
    chart,
    nice,
    sky_chart,
    sparkline,
)

DRAWN = 1040.0 - 56.0 - 12.0  # width between the axes


def curve(t_s: Sequence[float], values: Sequence[float | None], **more: Any) -> ChartLine:
    return ChartLine("a<b", t_s, values, "a", **more)


def path(drawn: str, kind: str = "line a") -> str:
    (found,) = re.findall(rf'<path class="{kind}" d="([^"]*)"', drawn)
    return str(found)


def points(text: str) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in re.findall(r"([-\d.]+) ([-\d.]+)", text)]


def labels(drawn: str, anchor: str) -> list[tuple[float, float, str]]:
    found = re.findall(rf'<text class="axis" x="([-\d.]+)" y="([-\d.]+)" text-anchor="{anchor}">([^<]*)</text>', drawn)
    return [(float(x), float(y), text) for x, y, text in found]


def test_margins_leave_the_middle_of_the_paper() -> None:
    assert (WIDTH, LEFT, RIGHT, TOP, BOTTOM, GAP_S, MOST_TICKS) == (1040.0, 56.0, 12.0, 24.0, 24.0, 5.0, 14)


def test_time_goes_right_and_values_go_up() -> None:
    frame = ChartFrame(100.0, 300.0, -10.0, 30.0, 200.0)
    assert [frame.x(t) for t in (100.0, 200.0, 300.0)] == pytest.approx([56.0, 56.0 + DRAWN / 2.0, 1028.0])
    assert [frame.y(value) for value in (-10.0, 0.0, 30.0)] == pytest.approx([176.0, 138.0, 24.0])
    assert ChartFrame(5.0, 5.0, 0.0, 1.0, 200.0).x(5.0) == 56.0


@pytest.mark.parametrize(
    ("values", "from_zero", "marks", "low", "high"),
    [
        ([10.0, 20.0], False, (), 9.4, 20.6),
        ([10.0, None, 20.0], False, (), 9.4, 20.6),
        ([10.0, 20.0], True, (), 0.0, 21.2),
        ([-10.0, 10.0], True, (), -11.2, 11.2),
        ([10.0, 20.0], False, ((40.0, "m"),), 8.2, 41.8),
        ([10.0, 20.0], False, ((0.0, "m"),), -1.2, 21.2),
        ([8.0], False, (), 4.0, 12.0),
        ([-8.0], False, (), -12.0, -4.0),
        ([0.0], False, (), -1.0, 1.0),
        ([0.0], True, (), 0.0, 1.0),
        ([None], False, (), -0.06, 1.06),
    ],
)
def test_the_axis_spans_what_is_known_with_a_margin(
    values: list[float | None], from_zero: bool, marks: tuple[tuple[float, str], ...], low: float, high: float
) -> None:
    t_s = [float(k) for k in range(len(values))]
    drawn = chart("t", "deg", [curve(t_s, values)], marks=marks, from_zero=from_zero)
    frame = ChartFrame(t_s[0], t_s[-1], low, high, 190.0)
    known = [(t, value) for t, value in zip(t_s, values, strict=True) if value is not None]
    assert points(path(drawn)) == [pytest.approx((frame.x(t), frame.y(value)), abs=0.06) for t, value in known]
    for value, text in marks:
        assert f'y1="{frame.y(value):.1f}" y2="{frame.y(value):.1f}"/><text class="axis" x="1024"' in drawn
        assert (1024.0, pytest.approx(frame.y(value) - 4.0, abs=0.06), text) in labels(drawn, "end")


def test_several_curves_share_the_axes() -> None:
    drawn = chart("t", "deg", [curve([0.0, 3.0], [1.0, 2.0]), curve([2.0, 6.0], [3.0, 11.0])])
    frame = ChartFrame(0.0, 6.0, 0.4, 11.6, 190.0)
    assert f"M{frame.x(2.0):.1f} {frame.y(3.0):.1f}L{frame.x(6.0):.1f} {frame.y(11.0):.1f}" in drawn
    assert f"M{frame.x(0.0):.1f} {frame.y(1.0):.1f}L{frame.x(3.0):.1f} {frame.y(2.0):.1f}" in drawn


def test_a_span_and_a_height_that_are_given_are_the_papers() -> None:
    drawn = chart("t", "deg", [curve([0.0, 4.0], [0.0, 100.0])], span_s=(-10.0, 30.0), height=300.0)
    frame = ChartFrame(-10.0, 30.0, -6.0, 106.0, 300.0)
    assert 'viewBox="0 0 1040 300"' in drawn
    assert f"M{frame.x(0.0):.1f} {frame.y(0.0):.1f}L{frame.x(4.0):.1f} {frame.y(100.0):.1f}" == path(drawn)


@pytest.mark.parametrize(
    ("t_s", "values", "parts"),
    [
        ([0.0, 1.0, 2.0], [1.0, 1.0, 1.0], [3]),
        ([0.0, 1.0, 2.0, 3.0], [1.0, None, 1.0, 1.0], [1, 2]),
        ([0.0, 5.0], [1.0, 1.0], [2]),
        ([0.0, 5.1], [1.0, 1.0], [1, 1]),
        ([0.0, 1.0, 2.0], [None, 1.0, None], [1]),
        ([0.0, 1.0, 6.0, 11.5], [0.0, 0.0, 0.0, 0.0], [3, 1]),
        ([0.0, 1.0], [None, None], []),
    ],
)
@pytest.mark.parametrize("has_dots", [False, True])
def test_a_curve_is_in_parts_where_nothing_is_known(
    t_s: list[float], values: list[float | None], parts: list[int], has_dots: bool
) -> None:
    drawn = chart("t", "deg", [curve(t_s, values, has_dots=has_dots)], span_s=(0.0, 20.0))
    if has_dots:
        assert path(drawn, "dots a").count("h0") == sum(parts) == path(drawn, "dots a").count("M")
        return
    assert [part.count("L") + 1 for part in path(drawn).split("M")[1:]] == parts


def test_a_value_of_zero_is_drawn_at_zero() -> None:
    drawn = chart("t", "deg", [curve([0.0, 1.0, 2.0], [-5.0, 0.0, 5.0])])
    assert points(path(drawn))[1] == pytest.approx((56.0 + DRAWN / 2.0, 95.0), abs=0.06)


def test_sigma_is_a_band_to_both_sides_held_within_the_axes() -> None:
    curves = [curve([0.0, 1.0, 2.0], [0.0, 0.0, 10.0], sigma=[1.0, None, 2.0])]
    drawn = chart("t", "deg", curves)
    frame = ChartFrame(0.0, 2.0, -0.6, 10.6, 190.0)
    assert points(path(drawn, "sigma a")) == [
        pytest.approx(place, abs=0.06)
        for place in (
            (frame.x(0.0), frame.y(1.0)),
            (frame.x(1.0), frame.y(0.0)),
            (frame.x(2.0), 24.0),
            (frame.x(2.0), frame.y(8.0)),
            (frame.x(1.0), frame.y(0.0)),
            (frame.x(0.0), 166.0),
        )
    ]
    assert path(drawn, "sigma a").endswith("Z")
    assert "<title>1 sigma of a&lt;b</title>" in drawn
    assert drawn.index('class="sigma') < drawn.index('class="line')  # behind the curve
    assert 'class="sigma' not in chart("t", "deg", [curve([0.0], [1.0])])


@pytest.mark.parametrize(
    ("from_s", "to_s", "shown"),
    [
        (20.0, 40.0, (20.0, 40.0)),
        (-50.0, 40.0, (0.0, 40.0)),
        (60.0, 900.0, (60.0, 100.0)),
        (-50.0, 900.0, (0.0, 100.0)),
        (-50.0, 0.0, None),
        (100.0, 900.0, None),
        (40.0, 40.0, None),
        (40.0, 20.0, None),
    ],
)
def test_a_band_is_as_long_as_it_is_within_the_chart(
    from_s: float, to_s: float, shown: tuple[float, float] | None
) -> None:
    drawn = chart("t", "deg", [curve([0.0, 100.0], [1.0, 2.0])], bands=[ChartBand(from_s, to_s, "bad", "x & y")])
    if shown is None:
        assert "<rect" not in drawn
        return
    x, wide = 56.0 + DRAWN * shown[0] / 100.0, DRAWN * (shown[1] - shown[0]) / 100.0
    assert (
        f'<rect class="band bad" x="{x:.1f}" y="24" width="{wide:.1f}" height="142"><title>x &amp; y</title></rect>'
        in drawn
    )
    assert drawn.index("<rect") < drawn.index('class="grid"') < drawn.index('class="line')


def test_a_short_band_is_seen_and_one_without_a_label_has_none() -> None:
    drawn = chart("t", "deg", [curve([0.0, 10000.0], [1.0, 2.0])], bands=[ChartBand(1.0, 2.0, "bad")])
    assert 'width="1.0" height="142"></rect>' in drawn


def test_without_a_curve_the_axes_go_from_zero_to_one() -> None:
    drawn = chart("t", "deg", [])
    frame = ChartFrame(0.0, 1.0, -0.06, 1.06, 190.0)
    assert [(text, y) for _, y, text in labels(drawn, "end")] == [
        (text, pytest.approx(frame.y(float(text)) + 4.0, abs=0.06)) for text in ("0", "0.25", "0.5", "0.75", "1")
    ]
    assert 'class="line' not in drawn
    marked = chart("t", "deg", [], marks=[(0.5, "m")])
    assert [text for _, _, text in labels(marked, "end")][-1] == "m"


def test_title_and_unit_are_words_and_not_marks_of_the_page() -> None:
    drawn = chart("<t>", "<deg>", [curve([0.0, 1.0], [1.0, 2.0])])
    assert "<title>&lt;t&gt;</title>" in drawn
    assert '<text class="axis unit" x="56" y="15">&lt;deg&gt;</text>' in drawn
    assert "<title>a&lt;b</title>" in drawn
    assert drawn.startswith('<svg class="chart"')
    assert drawn.endswith("</svg>")


def test_values_are_written_left_of_their_lines() -> None:
    drawn = chart("t", "deg", [curve([0.0, 60.0], [-0.001, 0.001])])
    frame = ChartFrame(0.0, 60.0, -0.00112, 0.00112, 190.0)
    assert labels(drawn, "end") == [
        (50.0, pytest.approx(frame.y(value) + 4.0, abs=0.06), text)
        for value, text in ((-0.001, "-0.001"), (-0.0005, "-0.0005"), (0.0, "0"), (0.0005, "0.0005"), (0.001, "0.001"))
    ]
    for value in (-0.001, 0.0, 0.001):
        assert f'<line class="grid" x1="56" x2="1028" y1="{frame.y(value):.1f}" y2="{frame.y(value):.1f}"/>' in drawn


@pytest.mark.parametrize(
    ("from_s", "to_s", "zero_s", "first", "step_s", "texts"),
    [
        (0.0, 600.0, 0.0, 0.0, 60.0, ["00:00", "00:01", "00:02", "00:03"]),
        (0.0, 600.0, 3600.0 * 13 + 90.0, 30.0, 60.0, ["13:02", "13:03"]),
        (6000.0, 6600.0, 0.0, 6000.0, 60.0, ["01:40", "01:41"]),
        (0.0, 840.0, 0.0, 0.0, 60.0, ["00:00", "00:01"]),
        (0.0, 841.0, 0.0, 0.0, 120.0, ["00:00", "00:02"]),
        (-100.0, 100.0, 86400.0, -90.0, 15.0, ["23:58:30", "23:58:45", "23:59:00"]),
        (0.0, 210.0, 45.0, 0.0, 15.0, ["00:00:45", "00:01:00"]),
        (0.0, 420.0, 45.0, 15.0, 30.0, ["00:01:00", "00:01:30"]),
        (0.0, 600.0, 86400.0 - 120.0, 0.0, 60.0, ["23:58", "23:59", "00:00", "00:01"]),
        (0.0, 86400.0 / 2.0, 0.0, 0.0, 3600.0, ["00:00", "01:00", "02:00"]),
        (0.0, 14.0 * 7200.0, 0.0, 0.0, 7200.0, ["00:00", "02:00", "04:00"]),
    ],
)
def test_times_below_are_utc_at_round_minutes_at_most_fourteen(
    from_s: float, to_s: float, zero_s: float, first: float, step_s: float, texts: list[str]
) -> None:
    drawn = chart("t", "deg", [curve([from_s, to_s], [0.0, 1.0])], zero_s_of_day=zero_s)
    frame = ChartFrame(from_s, to_s, 0.0, 1.0, 190.0)
    found = labels(drawn, "middle")
    assert [text for _, _, text in found[: len(texts)]] == texts
    expected = [frame.x(first + k * step_s) for k in range(int((to_s - first) // step_s) + 1)]
    assert [x for x, _, _ in found] == pytest.approx([x for x in expected if x <= 1016.0], abs=0.06)
    assert {y for _, y, _ in found} == {183.0}
    for x in expected:
        assert f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="24" y2="166"/>' in drawn
    assert len(expected) <= MOST_TICKS + 1


@pytest.mark.parametrize(
    ("low", "high", "most", "numbers"),
    [
        (0.0, 10.0, 5, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]),
        (0.0, 10.1, 5, [0.0, 2.5, 5.0, 7.5, 10.0]),
        (0.0, 5.0, 5, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]),
        (0.0, 5.1, 5, [0.0, 2.0, 4.0]),
        (0.0, 12.5, 5, [0.0, 2.5, 5.0, 7.5, 10.0, 12.5]),
        (0.0, 12.6, 5, [0.0, 5.0, 10.0]),
        (0.0, 26.0, 5, [0.0, 10.0, 20.0]),
        (-7.0, 7.0, 5, [-5.0, 0.0, 5.0]),
        (-0.2, 0.2, 5, [-0.2, -0.1, 0.0, 0.1, 0.2]),
        (100.0, 350.0, 5, [100.0, 150.0, 200.0, 250.0, 300.0, 350.0]),
        (101.0, 349.0, 5, [150.0, 200.0, 250.0, 300.0]),
    ],
)
def test_round_numbers_by_value(low: float, high: float, most: int, numbers: list[float]) -> None:
    assert nice(low, high, most) == pytest.approx(numbers)


# The sky


@pytest.mark.parametrize(
    ("az_deg", "el_deg", "x", "y"),
    [
        (0.0, 0.0, 180.0, 30.0),
        (90.0, 0.0, 330.0, 180.0),
        (180.0, 0.0, 180.0, 330.0),
        (270.0, 0.0, 30.0, 180.0),
        (90.0, 30.0, 280.0, 180.0),
        (90.0, 60.0, 230.0, 180.0),
        (90.0, 90.0, 180.0, 180.0),
        (90.0, 95.0, 180.0, 180.0),
        (90.0, -5.0, 330.0, 180.0),
        (450.0, 30.0, 280.0, 180.0),
    ],
)
def test_north_is_up_east_is_right_and_the_zenith_in_the_middle(
    az_deg: float, el_deg: float, x: float, y: float
) -> None:
    drawn = sky_chart("<sky>", [az_deg, 0.0], [el_deg, 90.0], [1, 1])
    assert path(drawn, "line good") == f"M{x:.1f} {y:.1f}L180.0 180.0"
    assert f'<circle class="end begin" cx="{x:.1f}" cy="{y:.1f}" r="4"><title>begin</title></circle>' in drawn
    assert '<circle class="end end" cx="180.0" cy="180.0" r="4"><title>end</title></circle>' in drawn
    assert "<title>&lt;sky&gt;</title>" in drawn


def test_the_part_up_to_a_point_has_the_colour_of_its_signal() -> None:
    drawn = sky_chart("t", [0.0, 90.0, 180.0, 270.0], [0.0, 0.0, 0.0, 0.0], [0, 1, 0, 0])
    assert path(drawn, "line good") == "M180.0 30.0L330.0 180.0"
    assert path(drawn, "line bad") == "M330.0 180.0L180.0 330.0M180.0 330.0L30.0 180.0"


def test_a_sky_without_a_path_has_its_circles_and_its_directions() -> None:
    drawn = sky_chart("t", [], [], [])
    assert re.findall(r'<circle class="grid" cx="180.0" cy="180.0" r="(\d+)"/>', drawn) == ["150", "100", "50"]
    assert re.findall(r'x="183.0" y="(\d+)">(\d+)°', drawn) == [("42", "0"), ("92", "30"), ("142", "60")]
    assert labels(drawn, "middle") == [
        (180.0, 20.0, "N"),
        (344.0, 184.0, "E"),
        (180.0, 348.0, "S"),
        (16.0, 184.0, "W"),
    ]
    assert '<path class="grid" d="M30.0 180.0H330.0M180.0 30.0V330.0"/>' in drawn
    assert 'class="end' not in drawn


# From pass to pass


@pytest.mark.parametrize(
    ("values", "drawn", "zero_y"),
    [
        ([0.0, 10.0], "M0.0 31.2L150.0 2.8", "31.2"),
        ([10.0, None, 20.0], "M0.0 31.2L150.0 2.8", None),
        ([-10.0, 10.0], "M0.0 31.2L150.0 2.8", "17.0"),
        ([-1.0, 0.0, 9.0], "M0.0 31.2L75.0 28.3L150.0 2.8", "28.3"),
        ([8.0], "M0.0 17.0", None),
        ([0.0], "M0.0 17.0", "17.0"),
        ([-8.0, -8.0], "M0.0 17.0L150.0 17.0", None),
    ],
)
def test_a_small_curve_goes_up_with_its_figure_and_shows_zero_where_it_is_near(
    values: list[float | None], drawn: str, zero_y: str | None
) -> None:
    spark = sparkline("<s>", values)
    assert path(spark) == drawn
    assert path(spark, "dots a").replace("h0M", "L").removesuffix("h0") == drawn
    assert (f'<path class="mark" d="M0 {zero_y}H150"/>' in spark) == (zero_y is not None)
    assert ('class="mark"' in spark) == (zero_y is not None)
    assert "<title>&lt;s&gt;</title>" in spark
    assert 'viewBox="0 0 150 34"' in spark


def test_a_small_curve_is_as_wide_and_high_as_it_is_wanted() -> None:
    spark = sparkline("s", [0.0, 10.0], width=300.0, height=68.0)
    assert path(spark) == "M0.0 62.3L300.0 5.7"
    assert 'viewBox="0 0 300 68"' in spark
    assert path(sparkline("s", [])) == ""

"""Charts as inline SVG: curves over the time of a pass with bands of states behind, and the path on the sky.  Pure.

Colours are classes, so that a page decides them, in the dark too.  Every chart has a title for who cannot see it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from math import ceil, cos, floor, log10, radians, sin

Values = Sequence[float | None]
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 1040.0, 56.0, 12.0, 24.0, 24.0
GAP_S = 5.0  # a curve is broken where nothing is known for so long
ROUND = (1.0, 2.0, 2.5, 5.0, 10.0)
MINUTES = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0)
MOST_TICKS = 14
LABEL = 12.0  # half the width of a time below the axis
LEAST_SPAN = 1e-6


@dataclass(frozen=True, slots=True)
class ChartLine:
    """Values over seconds.  sigma: a band of 1 sigma to both sides; has_dots: points, and no line between them."""

    label: str
    t_s: Sequence[float]
    values: Values
    kind: str  # class of its colour
    sigma: Values | None = None
    has_dots: bool = False


@dataclass(frozen=True, slots=True)
class ChartBand:
    """A span of time behind the curves."""

    from_s: float
    to_s: float
    kind: str
    label: str = ""


@dataclass(frozen=True, slots=True)
class ChartFrame:
    """How time and values lie on the paper."""

    from_s: float
    to_s: float
    low: float
    high: float
    height: float

    def x(self, t_s: float) -> float:
        return LEFT + (t_s - self.from_s) / max(self.to_s - self.from_s, LEAST_SPAN) * (WIDTH - LEFT - RIGHT)

    def y(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.height - BOTTOM - share * (self.height - TOP - BOTTOM)


def chart(
    title: str,
    unit: str,
    curves: Sequence[ChartLine],
    *,
    bands: Sequence[ChartBand] = (),
    marks: Sequence[tuple[float, str]] = (),
    zero_s_of_day: float = 0.0,
    span_s: tuple[float, float] | None = None,
    height: float = 190.0,
    from_zero: bool = False,
) -> str:
    """One chart.  marks: horizontal lines, each with a label; zero_s_of_day: UTC of t_s = 0, for the labels below."""
    frame = _frame(curves, marks, span_s, height, from_zero=from_zero)
    parts = [
        f'<svg class="chart" viewBox="0 0 {WIDTH:.0f} {height:.0f}" role="img"><title>{escape(title)}</title>',
        *_bands(frame, bands),
        *_grid(frame, unit, zero_s_of_day),
        *(_mark(frame, value, label) for value, label in marks),
        *(_sigma(frame, curve) for curve in curves if curve.sigma is not None),
        *(_line(frame, curve) for curve in curves),
        "</svg>",
    ]
    return "".join(parts)


def _frame(
    curves: Sequence[ChartLine],
    marks: Sequence[tuple[float, str]],
    span_s: tuple[float, float] | None,
    height: float,
    *,
    from_zero: bool,
) -> ChartFrame:
    values = [one for curve in curves for one in curve.values if one is not None] + [value for value, _ in marks]
    times = [t for curve in curves for t in curve.t_s]
    low, high = min(values, default=0.0), max(values, default=1.0)
    low = min(low, 0.0) if from_zero else low
    margin = 0.06 * (high - low) or 0.5 * abs(high) or 1.0
    low, high = (low if from_zero and low == 0.0 else low - margin), high + margin
    from_s, to_s = span_s or (min(times, default=0.0), max(times, default=1.0))
    return ChartFrame(from_s, to_s, low, high, height)


def _bands(frame: ChartFrame, bands: Sequence[ChartBand]) -> Iterator[str]:
    for band in bands:
        begin, end = max(band.from_s, frame.from_s), min(band.to_s, frame.to_s)
        if end > begin:
            x, width = frame.x(begin), frame.x(end) - frame.x(begin)
            title = f"<title>{escape(band.label)}</title>" if band.label else ""
            yield (
                f'<rect class="band {band.kind}" x="{x:.1f}" y="{TOP:.0f}" width="{max(width, 1.0):.1f}" '
                f'height="{frame.height - TOP - BOTTOM:.0f}">{title}</rect>'
            )


def _grid(frame: ChartFrame, unit: str, zero_s_of_day: float) -> Iterator[str]:
    bottom = frame.height - BOTTOM
    for value in nice(frame.low, frame.high, 5):
        y = frame.y(value)
        yield f'<line class="grid" x1="{LEFT:.0f}" x2="{WIDTH - RIGHT:.0f}" y1="{y:.1f}" y2="{y:.1f}"/>'
        yield f'<text class="axis" x="{LEFT - 6:.0f}" y="{y + 4:.1f}" text-anchor="end">{_short(value)}</text>'
    for t_s, text in _minutes(frame, zero_s_of_day):
        x = frame.x(t_s)
        yield f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP:.0f}" y2="{bottom:.0f}"/>'
        if x <= WIDTH - RIGHT - LABEL:
            yield f'<text class="axis" x="{x:.1f}" y="{frame.height - 7:.0f}" text-anchor="middle">{text}</text>'
    yield f'<text class="axis unit" x="{LEFT:.0f}" y="{TOP - 9:.0f}">{escape(unit)}</text>'


def _minutes(frame: ChartFrame, zero_s_of_day: float) -> Iterator[tuple[float, str]]:
    span_min = (frame.to_s - frame.from_s) / 60.0
    step_s = 60.0 * next((one for one in MINUTES if span_min / one <= MOST_TICKS), span_min / MOST_TICKS)
    k = ceil((frame.from_s + zero_s_of_day) / step_s)
    while (t_s := k * step_s - zero_s_of_day) <= frame.to_s:
        of_day = round(k * step_s) % 86400
        seconds = f":{of_day % 60:02d}" if step_s < 60.0 else ""
        yield t_s, f"{of_day // 3600:02d}:{of_day // 60 % 60:02d}{seconds}"
        k += 1


def nice(low: float, high: float, most: int) -> list[float]:
    """Round numbers in a range, at most so many and one more."""
    rough = max((high - low) / most, LEAST_SPAN)
    power = 10.0 ** floor(log10(rough))
    step = next(one * power for one in ROUND if one * power >= rough * (1.0 - 1e-9))
    first = ceil(low / step - 1e-9)
    return [k * step for k in range(first, floor(high / step + 1e-9) + 1)]


def _short(value: float) -> str:
    return f"{0.0 if abs(value) < LEAST_SPAN else value:.4g}"


def _mark(frame: ChartFrame, value: float, label: str) -> str:
    y = frame.y(value)
    return (
        f'<line class="mark" x1="{LEFT:.0f}" x2="{WIDTH - RIGHT:.0f}" y1="{y:.1f}" y2="{y:.1f}"/>'
        f'<text class="axis" x="{WIDTH - RIGHT - 4:.0f}" y="{y - 4:.1f}" text-anchor="end">{escape(label)}</text>'
    )


def _runs(curve: ChartLine) -> Iterator[list[int]]:
    """Points that belong together: none missing, no gap in time."""
    run: list[int] = []
    for k, value in enumerate(curve.values):
        if value is None or (run and curve.t_s[k] - curve.t_s[run[-1]] > GAP_S):
            if run:
                yield run
            run = []
        if value is not None:
            run.append(k)
    if run:
        yield run


def _line(frame: ChartFrame, curve: ChartLine) -> str:
    points = [[(frame.x(curve.t_s[k]), frame.y(curve.values[k] or 0.0)) for k in run] for run in _runs(curve)]
    if curve.has_dots:
        path = "".join(f"M{x:.1f} {y:.1f}h0" for run in points for x, y in run)
        return f'<path class="dots {curve.kind}" d="{path}"><title>{escape(curve.label)}</title></path>'
    path = "".join("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in run) for run in points)
    return f'<path class="line {curve.kind}" d="{path}"><title>{escape(curve.label)}</title></path>'


def _sigma(frame: ChartFrame, curve: ChartLine) -> str:
    sigma = curve.sigma or ()
    path = ""
    for run in _runs(curve):
        upper = [(frame.x(curve.t_s[k]), frame.y((curve.values[k] or 0.0) + (sigma[k] or 0.0))) for k in run]
        lower = [(frame.x(curve.t_s[k]), frame.y((curve.values[k] or 0.0) - (sigma[k] or 0.0))) for k in reversed(run)]
        path += "M" + "L".join(f"{x:.1f} {_held(y, frame):.1f}" for x, y in upper + lower) + "Z"
    return f'<path class="sigma {curve.kind}" d="{path}"><title>1 sigma of {escape(curve.label)}</title></path>'


def _held(y: float, frame: ChartFrame) -> float:
    return min(max(y, TOP), frame.height - BOTTOM)


def sky_chart(title: str, az_deg: Sequence[float], el_deg: Sequence[float], is_good: Sequence[int]) -> str:
    """The path over the station: north up, east right, the zenith in the middle; without signal in another colour."""
    half, radius = 180.0, 150.0
    parts = [f'<svg class="sky" viewBox="0 0 360 360" role="img"><title>{escape(title)}</title>']
    for el in (0.0, 30.0, 60.0):
        parts.append(f'<circle class="grid" cx="{half}" cy="{half}" r="{radius * (90.0 - el) / 90.0:.0f}"/>')
        parts.append(
            f'<text class="axis" x="{half + 3}" y="{half - radius * (90.0 - el) / 90.0 + 12:.0f}">{el:.0f}°</text>'
        )
    for az, name in ((0.0, "N"), (90.0, "E"), (180.0, "S"), (270.0, "W")):
        x, y = half + (radius + 14) * sin(radians(az)), half - (radius + 14) * cos(radians(az))
        parts.append(f'<text class="axis" x="{x:.0f}" y="{y + 4:.0f}" text-anchor="middle">{name}</text>')
    parts.append(
        f'<path class="grid" d="M{half - radius} {half}H{half + radius}M{half} {half - radius}V{half + radius}"/>'
    )
    places = [_place(az, el, half, radius) for az, el in zip(az_deg, el_deg, strict=True)]
    for kind, wanted in (("good", 1), ("bad", 0)):
        path = "".join(
            f"M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}"
            for (a, b), good in zip(pairwise(places), is_good[1:], strict=True)
            if good == wanted
        )
        parts.append(f'<path class="line {kind}" d="{path}"/>')
    if places:
        for (x, y), name in ((places[0], "begin"), (places[-1], "end")):
            parts.append(f'<circle class="end {name}" cx="{x:.1f}" cy="{y:.1f}" r="4"><title>{name}</title></circle>')
    return "".join([*parts, "</svg>"])


def _place(az_deg: float, el_deg: float, half: float, radius: float) -> tuple[float, float]:
    r = radius * (90.0 - min(max(el_deg, 0.0), 90.0)) / 90.0
    return half + r * sin(radians(az_deg)), half - r * cos(radians(az_deg))


def sparkline(title: str, values: Values, width: float = 150.0, height: float = 34.0) -> str:
    """A small curve of one figure from pass to pass, with zero where it is near."""
    known = [one for one in values if one is not None]
    low, high = min(known, default=0.0), max(known, default=1.0)
    spare = 0.1 * (high - low) or 0.5 * abs(high) or 1.0
    low, high = low - spare, high + spare
    step = width / max(len(values) - 1, 1)
    points = [
        (k * step, height - (one - low) / (high - low) * height) for k, one in enumerate(values) if one is not None
    ]
    zero = (
        f'<path class="mark" d="M0 {height + low / (high - low) * height:.1f}H{width:.0f}"/>'
        if low < 0.0 < high
        else ""
    )
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) if points else ""
    dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in points)
    return (
        f'<svg class="spark" viewBox="0 0 {width:.0f} {height:.0f}" role="img"><title>{escape(title)}</title>{zero}'
        f'<path class="line a" d="{path}"/><path class="dots a" d="{dots}"/></svg>'
    )

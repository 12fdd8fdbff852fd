#!/usr/bin/env python3
"""Draws the states of tracking and what leads from one to another, from the table: docs/pictures/states.svg.

A number is the row of the table, the lowest that applies wins.  States of a pass stand on an ellipse, so that no
arrow passes through a state; rows that lead out of many states have no arrows but a line in the state they lead to.
"""

from collections.abc import Iterator, Set
from dataclasses import dataclass
from html import escape
from math import cos, hypot, pi, sin
from pathlib import Path

from acu_daemon.control.tracking.state_table import ACTIVE, AUTOTRACKING, HOLDING, TABLE, Row, TrackState

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "states.svg"
WIDTH, TOP, MARGIN = 1370, 84, 20
CENTRE, RADII = (850.0, 390.0), (390.0, 270.0)
BOX, LINE = (172.0, 40.0), 15
WIDE_COUNT = 4  # a row with more sources than this has no arrows
BEND_RIGHT, BEND_LEFT = 0.18, 0.04  # of an arrow's length, inwards: there and back stand apart, and pass by no state
LABEL_SHARES = [0.3 + 0.05 * k for k in range(9)]  # where along an arrow its numbers may stand
S = TrackState
ROUND = (
    S.IDLE,
    S.PREPOSITION,
    S.ACQUIRE_TLE,
    S.AUTOTRACK_TLE,
    S.AUTOTRACK_FITTED,
    S.ZENITH,
    S.FALSE_LOCK,
    S.HOLD_FITTED,
    S.SEARCH,
    S.HOLD_TLE,
)
COLOURS = {
    S.IDLE: "#555555", S.PREPOSITION: "#8a6d00", S.ACQUIRE_TLE: "#b34700", S.AUTOTRACK_TLE: "#2e7d32",
    S.AUTOTRACK_FITTED: "#006064", S.HOLD_FITTED: "#1a4fa3", S.HOLD_TLE: "#6a1b9a", S.SEARCH: "#b0003a",
    S.ZENITH: "#5d4037", S.FALSE_LOCK: "#c62828",
}  # fmt: skip
OTHER_COLOUR = "#555555"
NAMES: tuple[tuple[str, Set[TrackState]], ...] = (
    ("IDLE and every state of a pass", ACTIVE - {S.SLAVED} | {S.IDLE}),
    ("every state of a pass", ACTIVE - {S.SLAVED}),
    ("SLAVED and every state of a pass", ACTIVE),
    ("every state of a pass but PREPOSITION", ACTIVE - {S.PREPOSITION, S.SLAVED}),
)
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Arrow:
    """From one state to another, with the numbers of the rows that lead there."""

    source: TrackState
    target: TrackState
    numbers: tuple[int, ...]


def places() -> dict[TrackState, Point]:
    """The middle of each state's box: of a pass on the ellipse from the left on, the others in a column beside."""
    found: dict[TrackState, Point] = {}
    for k, state in enumerate(ROUND):
        angle = pi + 2 * pi * k / len(ROUND)
        found[state] = (CENTRE[0] + RADII[0] * cos(angle), CENTRE[1] + RADII[1] * sin(angle))
    others = [state for state in TrackState if state not in found]
    for k, state in enumerate(others):
        found[state] = (MARGIN + BOX[0] / 2 + 15, TOP + 70 + (k + 0.5) * (2 * RADII[1]) / len(others) - 20)
    return found


def arrows() -> list[Arrow]:
    """Those of the rows with few sources, one for each pair of states."""
    numbers: dict[tuple[TrackState, TrackState], list[int]] = {}
    for number, row in enumerate(TABLE, 1):
        if len(row.sources) <= WIDE_COUNT:
            for source in ordered(row.sources):
                numbers.setdefault((source, row.target), []).append(number)
    return [Arrow(*ends, tuple(found)) for ends, found in numbers.items()]


def ordered(states: Set[TrackState]) -> list[TrackState]:
    """In the order of the enumeration: a set has none of its own."""
    return [state for state in TrackState if state in states]


def named(states: Set[TrackState]) -> str:
    """A set of states in words."""
    if name := next((name for name, known in NAMES if known == states), ""):
        return name
    left_out = [state for state in TrackState if state not in states]
    if len(left_out) < len(states):
        return f"all but {', '.join(left_out)}" if left_out else "all"
    return ", ".join(ordered(states))


def into(state: TrackState) -> Iterator[str]:
    """The lines of a box about rows without arrows."""
    wide: dict[str, list[str]] = {}
    for number, row in enumerate(TABLE, 1):
        if row.target is state and len(row.sources) > WIDE_COUNT:
            wide.setdefault(named(row.sources), []).append(str(number))
    for names, numbers in wide.items():
        yield f"{', '.join(numbers)} from {names}"


def edge_point(place: Point, toward: Point) -> Point:
    """Where the line from the middle of a box to a point leaves the box."""
    dx, dy = toward[0] - place[0], toward[1] - place[1]
    scale = min((BOX[0] / 2 + 3) / max(abs(dx), 1e-9), (BOX[1] / 2 + 3) / max(abs(dy), 1e-9))
    return place[0] + dx * scale, place[1] + dy * scale


def draw_arrow(arrow: Arrow, at: dict[TrackState, Point], labels: list[Point]) -> list[str]:
    """A curve and its numbers, these where they are farthest from those already there; adds them to labels."""
    (x0, y0), (x1, y1) = at[arrow.source], at[arrow.target]
    middle, across = ((x0 + x1) / 2, (y0 + y1) / 2), (y0 - y1, x1 - x0)  # to the right of the arrow
    is_right = (CENTRE[0] - middle[0]) * across[0] + (CENTRE[1] - middle[1]) * across[1] > -1.0
    bend = BEND_RIGHT if is_right else -BEND_LEFT
    bent = (middle[0] + across[0] * bend, middle[1] + across[1] * bend)
    start, end = edge_point((x0, y0), bent), edge_point((x1, y1), bent)

    def on_curve(share: float) -> Point:
        a, b, c = (1 - share) ** 2, 2 * share * (1 - share), share**2
        return a * start[0] + b * bent[0] + c * end[0], a * start[1] + b * bent[1] + c * end[1]

    x, y = max(
        map(on_curve, LABEL_SHARES),
        key=lambda spot: min((hypot(spot[0] - a, spot[1] - b) for a, b in labels), default=0.0),
    )
    labels.append((x, y))
    colour, text = COLOURS.get(arrow.source, OTHER_COLOUR), ", ".join(map(str, arrow.numbers))
    width = 7.5 * len(text) + 8
    return [
        f'<path fill="none" stroke="{colour}" stroke-width="1.6" marker-end="url(#tip-{colour[1:]})" '
        f'd="M{start[0]:.0f} {start[1]:.0f}Q{bent[0]:.0f} {bent[1]:.0f} {end[0]:.0f} {end[1]:.0f}"/>',
        f'<rect x="{x - width / 2:.0f}" y="{y - 9:.0f}" width="{width:.0f}" height="18" rx="8" fill="white" '
        f'stroke="{colour}"/><text class="number" x="{x:.0f}" y="{y + 4:.0f}" fill="{colour}">{text}</text>',
    ]


def draw_box(state: TrackState, place: Point) -> list[str]:
    """A state; below it the rows without arrows."""
    x, y = place[0] - BOX[0] / 2, place[1] - BOX[1] / 2
    colour = COLOURS.get(state, OTHER_COLOUR)
    fill = "#e6f2e6" if state in AUTOTRACKING else "#e6edf7" if state in HOLDING else "#f6f6f6"
    return [
        f'<rect x="{x:.0f}" y="{y:.0f}" width="{BOX[0]:.0f}" height="{BOX[1]:.0f}" rx="8" fill="{fill}" '
        f'stroke="{colour}" stroke-width="2"/>',
        f'<text class="state" x="{place[0]:.0f}" y="{place[1] + 5:.0f}">{escape(state)}</text>',
        *(
            f'<text class="wide" x="{x:.0f}" y="{y + BOX[1] + LINE * (k + 1):.0f}">{escape(line)}</text>'
            for k, line in enumerate(into(state))
        ),
    ]


def legend(top: float) -> list[str]:
    """Every row of the table in words."""
    lines = [
        (f"{number}", f"{named(row.sources)} → {row.target}", f"{row.cause}", f"{row.limit}")
        for number, row in enumerate(TABLE, 1)
    ]
    columns = (MARGIN + 22, MARGIN + 34, 430, 920)
    texts = []
    for k, line in enumerate((("", "from → to", "because", "when"), *lines)):
        kind = "head" if k == 0 else "row"
        for x, text, column in zip(columns, line, range(len(columns)), strict=True):
            anchor = ' text-anchor="end"' if column == 0 else ""
            texts.append(f'<text class="{kind}" x="{x}" y="{top + 17 * k:.0f}"{anchor}>{escape(text)}</text>')
    return texts


def draw(table: tuple[Row, ...] = TABLE) -> str:
    """The picture, as SVG."""
    at, labels = places(), []
    bottom = CENTRE[1] + RADII[1] + BOX[1] + 40
    height = bottom + 17 * (len(table) + 1) + MARGIN
    colours = sorted({*COLOURS.values(), OTHER_COLOUR})
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}">',
        "<style>text{font:12px sans-serif}.state{font-size:14px;font-weight:bold;text-anchor:middle}"
        ".number{font-weight:bold;text-anchor:middle}.wide{fill:#444;stroke:white;stroke-width:4px;paint-order:stroke}.head{font-weight:bold}"
        ".title{font-size:17px;font-weight:bold}</style><defs>",
        *(
            f'<marker id="tip-{colour[1:]}" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" '
            f'orient="auto"><path d="M0 0L8 4L0 8z" fill="{colour}"/></marker>'
            for colour in colours
        ),
        f'</defs><rect width="{WIDTH}" height="{height:.0f}" fill="white"/>',
        f'<text class="title" x="{MARGIN}" y="34">States of tracking</text>',
        f'<text x="{MARGIN}" y="56">Numbers are rows of the table below, read from the top: the first whose cause is '
        "there is taken.  Rows out of many states stand under the state they lead to.</text>",
    ]
    for arrow in arrows():
        parts += draw_arrow(arrow, at, labels)
    for state, place in at.items():
        parts += draw_box(state, place)
    return "\n".join([*parts, *legend(bottom), "</svg>\n"])


if __name__ == "__main__":
    PICTURE.write_text(draw(), encoding="utf-8")

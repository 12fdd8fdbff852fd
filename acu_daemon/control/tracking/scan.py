"""Where SEARCH looks: rows parallel to the path, that on it first, then to its right and left in turn.  Pure.

A place is (seconds late along the track, degrees right across it), as in control.tracking.track_frame.  The satellite
stands still in this frame, so what was looked at stays looked at, also while something else is done, and a search goes
on where it was.

Each row is covered from some place outwards, early and late; a row never has a hole.  The row on the path grows in
steps to both sides, for that is where the satellite most likely is.  The beam moves along a row at the pace that beam
and drives allow, and only while the antenna is where it was told; what counts as covered is what the readings show that
it saw.  Where the mask or a limit is in the way a side waits, and another is looked at meanwhile.

What must be covered comes in parts: first what lies within both the keys and 3 sigma of the prediction, then what the
keys say, then the rest of the 3 sigma.  Where the keys end before 2 sigma along the track, three rows about it go
beyond them before all else, by a third as much again at most: elements are wrong along the track more than across it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, cos, hypot, radians

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import Scan
from acu_daemon.control.tracking.track_frame import SIGMAS, beside, extents, offset_of, three_sigma_of
from acu_daemon.model import AxisLimits, Pointing, Prediction, Reading
from acu_daemon.pointing.wrap import nearest_turn

ROW_BEAMS = 0.7  # from row to row: what lies between two is 0.35 beams off at most, and half a beam is seen
DWELL_S = 1.25  # the beam moves by its width in so long: what it crosses at its edge stays in it for 8 readings
DRIVE_SHARE = 0.8  # of the drive's rate, for path and scan together
ON_PLACE_BEAMS = 0.15  # the antenna is where it was told: with the half of a row's distance that is half a beam
PATIENCE_S, LEAST_BEAMS = 10.0, 0.5  # one that never comes so near shall not end the search: half a beam has to do
BEHIND_S = 0.3  # of the scan's motion, by which a reading is older than what the registers hold
STEP_SHARE = 0.5  # of the extent along the track: the row on the path grows by so much on one side, then on the other
ENDS_S = 0.05  # nearer to its end than this a row is covered
SLOWEST_DEG_S, LEAST_PACE = 0.005, 1e-3
LEAST_ALONG_S = 1.0  # a row's length to each side
LIKELY_SIGMAS, MOST_OF_KEYS = 2.0, 1.3  # along the track: three rows about it go so far first, beyond the keys


@dataclass(frozen=True, slots=True)
class Box:
    """What is to be covered: so many seconds along on both sides, so many rows on each side of the path."""

    along_s: float
    row_count: int

    def rows(self) -> Iterator[int]:
        """0, 1, -1, 2, -2, ...: right is positive."""
        yield 0
        for k in range(1, self.row_count + 1):
            yield k
            yield -k


def row_deg(config: ControlConfig) -> float:
    """Degrees from row to row."""
    return ROW_BEAMS * config.beamwidth_deg


def boxes(prediction: Prediction | None, config: ControlConfig) -> tuple[Box, ...]:
    """What keys and covariance both say, what the keys say, and what either says; before them a longer track."""
    keys, most = (config.search_along_s, config.search_across_deg), extents(prediction, config)
    three_sigma = three_sigma_of(prediction) or keys
    least = (max(min(three_sigma[0], keys[0]), LEAST_ALONG_S), min(three_sigma[1], keys[1]))
    first, second, third = (Box(along_s, _row_count(across_deg, config)) for along_s, across_deg in (least, keys, most))
    likely_s = min(LIKELY_SIGMAS / SIGMAS * three_sigma[0], MOST_OF_KEYS * first.along_s)
    track = (Box(likely_s, min(1, first.row_count)),) if likely_s > first.along_s else ()
    return *track, first, second, third


def _row_count(across_deg: float, config: ControlConfig) -> int:
    """So many rows that the outermost, with its half of the distance between rows, reaches what is across_deg off."""
    return max(0, ceil((across_deg - row_deg(config) / 2) / row_deg(config) - 1e-9))


def place(scan: Scan, config: ControlConfig) -> tuple[float, float]:
    """Where the search looks."""
    return scan.along_s, scan.row * row_deg(config)


def look(
    scan: Scan, prediction: Prediction, tai_s: float, config: ControlConfig, *, pace: float = 0.0
) -> Pointing | None:
    """The direction of the place in hand; None outside the buffer."""
    return beside(prediction, tai_s, place(scan, config), pace=pace)


def pointing(scan: Scan, prediction: Prediction, tai_s: float, config: ControlConfig) -> Pointing | None:
    """What the registers shall hold: the place, never below the mask.  The axes' limits are the gate's."""
    pace = scan.side * pace_s_s(scan, prediction, tai_s, config) if scan.is_moving else 0.0
    point = look(scan, prediction, tai_s, config, pace=pace)
    if point is None:
        return None
    el_deg = max(point.el_deg, config.min_elevation_deg)
    return replace(point, el_deg=el_deg, el_rate_deg_s=point.el_rate_deg_s if el_deg == point.el_deg else 0.0)


def may_look(point: Pointing | None, tai_s: float, config: ControlConfig) -> bool:
    """Whether the antenna may point there, and sees anything: above the mask, within the limits, outside keep-outs."""
    if point is None or not point.is_finite:
        return False
    lowest_deg = max(config.elevation.min_deg, config.min_elevation_deg)
    is_high_enough = lowest_deg <= point.el_deg <= config.elevation.max_deg
    envelope = config.envelope
    is_seen = envelope.over_skyline_deg(point.az_deg, point.el_deg) >= 0.0
    is_seen = is_seen and envelope.clearance_deg(point.az_deg, point.el_deg, tai_s) >= 0.0
    return is_high_enough and is_seen and nearest_turn(point.az_deg, 0.0, config.azimuth) is not None


def go_on(
    scan: Scan, prediction: Prediction, reading: Reading, now_tai_s: float, dt_s: float, config: ControlConfig
) -> Scan:
    """Look on by what a reading shows; dt_s: since the one before it, 0 where that is too long ago."""
    if scan.model is not prediction.model:
        scan = Scan(model=prediction.model)
    scan = replace(scan, is_moving=False)
    if scan.is_aimed and scan.side:
        seen = offset_of(prediction, reading.tai_s, reading.az_deg, reading.el_deg)
        if seen is not None:
            scan = _grown(scan, seen, prediction, now_tai_s, dt_s, config)
    return _aimed(scan, prediction, now_tai_s, config)


def _grown(
    scan: Scan, seen: tuple[float, float], prediction: Prediction, tai_s: float, dt_s: float, config: ControlConfig
) -> Scan:
    """The row in hand, longer by what the antenna has seen of it, and the place moved on where the antenna is near."""
    pace, sky_deg_s = pace_s_s(scan, prediction, tai_s, config), _sky_deg_s(look(scan, prediction, tai_s, config))
    near_deg = (ON_PLACE_BEAMS if scan.waited_s < PATIENCE_S else LEAST_BEAMS) * config.beamwidth_deg
    is_on_row = abs(seen[1] - scan.row * row_deg(config)) < near_deg
    behind_deg = abs(scan.along_s - seen[0]) * sky_deg_s - pace * BEHIND_S * sky_deg_s
    if not is_on_row or behind_deg > near_deg:
        return replace(scan, waited_s=scan.waited_s + dt_s)
    early_s, late_s = scan.covered.get(scan.row, (scan.along_s, scan.along_s))
    covered = (min(early_s, seen[0]), max(late_s, seen[0]))
    scan = replace(scan, rows=tuple(sorted((scan.covered | {scan.row: covered}).items())))
    moved = replace(scan, along_s=scan.along_s + scan.side * dt_s * pace, is_moving=True)
    return moved if may_look(look(moved, prediction, tai_s, config), tai_s, config) else replace(scan, is_aimed=False)


def pace_s_s(scan: Scan, prediction: Prediction, tai_s: float, config: ControlConfig) -> float:
    """Seconds along the track in a second: a beam in DWELL_S, and no more than the drives have left beside the path."""
    point = look(scan, prediction, tai_s, config)
    if point is None:
        return 0.0
    pace = config.beamwidth_deg / DWELL_S / _sky_deg_s(point)
    for rate_deg_s, axis in ((point.az_rate_deg_s, config.azimuth), (point.el_rate_deg_s, config.elevation)):
        pace = min(pace, _spare(abs(rate_deg_s), axis, is_early=scan.side < 0))
    return max(pace, 0.0)


def _sky_deg_s(point: Pointing | None) -> float:
    if point is None:
        return SLOWEST_DEG_S
    return max(hypot(point.az_rate_deg_s * cos(radians(point.el_deg)), point.el_rate_deg_s), SLOWEST_DEG_S)


def _spare(rate_deg_s: float, axis: AxisLimits, *, is_early: bool) -> float:
    """Early, the beam runs ahead of the path: rate x (1 + pace); late, it falls back: rate x (1 - pace)."""
    paths = DRIVE_SHARE * axis.max_rate_deg_s / max(rate_deg_s, 1e-9)
    return paths - 1.0 if is_early else paths + 1.0


def _aimed(scan: Scan, prediction: Prediction, tai_s: float, config: ControlConfig) -> Scan:
    """Choose the row and the side to look at: those in hand while they last, else the next in turn."""
    asked = boxes(prediction, config)
    for row, side, edge_s in _open(scan, asked):
        if scan.is_aimed and (row, side) == (scan.row, scan.side):
            return scan
        aimed = replace(scan, row=row, side=side, along_s=edge_s, is_aimed=True, waited_s=0.0)
        if may_look(look(aimed, prediction, tai_s, config), tai_s, config) and _may_grow(
            aimed, prediction, tai_s, config
        ):
            return aimed
    if is_done(scan, asked):
        return Scan(model=scan.model, round_count=scan.round_count + 1)
    return replace(scan, row=0, side=0, along_s=0.0, is_aimed=False)


def _open(scan: Scan, asked: tuple[Box, ...]) -> Iterator[tuple[int, int, float]]:
    """Row, side and edge of all that is not covered, in the order in which it is looked at."""
    for box in asked:
        for row in box.rows():
            for side, edge_s in _sides(scan, row, box):
                yield row, side, edge_s


def _may_grow(scan: Scan, prediction: Prediction, tai_s: float, config: ControlConfig) -> bool:
    """Whether there is anything to see beyond the place, on its side."""
    beyond = replace(scan, along_s=scan.along_s + scan.side * ENDS_S)
    return may_look(look(beyond, prediction, tai_s, config), tai_s, config)


def _sides(scan: Scan, row: int, box: Box) -> Iterator[tuple[int, float]]:
    """The sides of a row that are not covered yet, the better one first: -1 early, 1 late, and where each begins."""
    if row not in scan.covered:
        starts = (0.0,) if row == 0 else (-box.along_s, box.along_s, 0.0)
        for start_s in sorted(starts, key=lambda one: abs(one - scan.along_s)):
            yield (-1 if start_s > 0.0 else 1), start_s
        return
    early_s, late_s = scan.covered[row]
    open_sides = [
        (side, edge_s) for side, edge_s in ((-1, early_s), (1, late_s)) if side * edge_s < box.along_s - ENDS_S
    ]
    step_s = STEP_SHARE * box.along_s
    if row == 0:  # in steps, in turn: the side that has fewer of them whole
        open_sides.sort(key=lambda one: (int(one[0] * one[1] / step_s + 1e-6), one[0] != scan.side))
    else:
        open_sides.sort(key=lambda one: one[0] != scan.side)
    yield from open_sides


def is_done(scan: Scan, asked: tuple[Box, ...]) -> bool:
    """Whether all is covered."""
    return next(_open(scan, asked), None) is None


# For people


def covered_text(scan: Scan, prediction: Prediction | None, config: ControlConfig) -> str:
    """What is covered of what is asked: along on the path; across as far as rows are covered as the keys say."""
    most_along_s, most_across_deg = extents(prediction, config)
    early_s, late_s = scan.covered.get(0, (0.0, 0.0))
    left_deg, right_deg = (_across_deg(scan, side, config) for side in (-1, 1))
    return (
        f"{early_s:+.1f} to {late_s:+.1f} s of +-{most_along_s:.0f} s along, "
        f"{left_deg:+.2f} to {right_deg:+.2f} deg of +-{most_across_deg:.1f} deg across"
    ) + (f", round {scan.round_count + 1}" if scan.round_count else "")


def _across_deg(scan: Scan, side: int, config: ControlConfig) -> float:
    """How far the whole rows reach on a side, with the half beam."""
    whole, count = Box(config.search_along_s, 0), 0
    if next(_sides(scan, 0, whole), None) is not None:
        return 0.0
    while next(_sides(scan, side * (count + 1), whole), None) is None:
        count += 1
    return side * (count * row_deg(config) + config.beamwidth_deg / 2)


def needed_s(scan: Scan, prediction: Prediction, tai_s: float, config: ControlConfig) -> tuple[float, float]:
    """About how long the rest takes at the present pace, ways between left out: of what the keys say, and of all."""
    on_path = Scan(side=-1)
    pace = max(pace_s_s(on_path, prediction, tai_s, config), LEAST_PACE)
    keys, whole = boxes(prediction, config)[-2:]
    return _open_s(scan, (keys,)) / pace, _open_s(scan, (keys, whole)) / pace


def _open_s(scan: Scan, asked: tuple[Box, ...]) -> float:
    """Seconds along the track that are not covered, over all rows."""
    widest: dict[int, float] = {}
    for box in asked:
        widest |= {row: max(box.along_s, widest.get(row, 0.0)) for row in box.rows()}
    total_s = 0.0
    for row, along_s in widest.items():
        early_s, late_s = scan.covered.get(row, (0.0, 0.0))
        total_s += max(along_s + early_s, 0.0) + max(along_s - late_s, 0.0)
    return total_s

"""The exact plan: which passes, which parts of them, so that priority times useful seconds is largest.

Weighted intervals with gaps that depend on what comes before.  A *slot* is a pass, or a part of one that may be cut, on
one turn of the cable wrap.  Slots are sorted by their ends; the best value of a plan that ends with a slot is its own
value plus the best of those slots before it from which the antenna is there in time:

    F(j) = v(j) + max over i of F(i),   end(i) + post + slew(i -> j) + pre <= start(j).

Beyond the longest gap of the pedestal every slot is reached from every other one, so a running maximum serves there and
pairs are looked at within that gap only.  The value of a cut is linear in its time, so a cut is tried where it can be
best: where a neighbour's reservation begins or ends, and where it leaves a part just the least that is worth having.
The plan is exact over these slots.

What must be comes first: frozen reservations, then the passes that people force, each worth more than all others.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.schedule.pass_track import STEP_S, PassTrack
from acu_daemon.schedule.rules import StationRules
from acu_daemon.units import Array

FORCED_VALUE, FROZEN_VALUE = 1e8, 1e11  # far above 9 x the seconds of a week
FILLER = 1e-6  # what a second is worth beyond its priority: a pass of priority 0 fills a gap
TRAVEL_PRICE = 1e-7  # of a degree: of plans that are worth as much, the one that moves less
CUT_ROUNDS = 4  # the slew to a part depends on where it begins


@dataclass(frozen=True, slots=True)
class Slot:
    """A reservation of the antenna: times TAI s, encoder angles deg at its ends, azimuth continuous."""

    track: PassTrack
    start_tai_s: float
    end_tai_s: float
    start_deg: tuple[float, float]
    end_deg: tuple[float, float]
    useful_s: float

    @property
    def value(self) -> float:
        return (self.track.rules.priority + FILLER) * self.useful_s

    @property
    def is_cut(self) -> bool:
        return self.start_tai_s > self.track.start_tai_s or self.end_tai_s < self.track.end_tai_s


@dataclass(frozen=True, slots=True)
class AntennaPlace:
    """Where the antenna is and from when on it is free."""

    free_tai_s: float
    az_deg: float
    el_deg: float


def best_slots(
    tracks: Sequence[PassTrack],
    rules: StationRules,
    *,
    frozen: Sequence[Slot] = (),
    forced: Sequence[PassTrack] = (),
    place: AntennaPlace | None = None,
) -> list[Slot]:
    """The slots of the best plan, in order.

    tracks: what may be tracked at all, windows apart.  frozen: reservations that stay; their passes need not be among
    the tracks.  place: where the antenna is; None: anywhere, in time for all.
    """
    frozen_passes = {id(slot.track) for slot in frozen}
    slots = [
        *frozen,
        *(one for track in tracks if id(track) not in frozen_passes for one in slots_of(track, tracks, rules)),
    ]
    if place is not None:
        slots = [joined for slot in slots if (joined := _joined(slot, place, rules)) is not None]
    slots.sort(key=lambda slot: (slot.end_tai_s, slot.start_tai_s))
    most_s = {id(track): 0.0 for track in forced}
    for slot in slots:
        if id(slot.track) in most_s:
            most_s[id(slot.track)] = max(most_s[id(slot.track)], slot.useful_s)
    extra = [FROZEN_VALUE if id(slot.track) in frozen_passes else _forced_value(slot, most_s) for slot in slots]
    return _best_chain(slots, np.array(extra), rules)


def _forced_value(slot: Slot, most_s: Mapping[int, float]) -> float:
    """Of a part only its share: two parts of a forced pass are not worth more than the whole.  most_s: by track."""
    return FORCED_VALUE * slot.useful_s / most if (most := most_s.get(id(slot.track), 0.0)) > 0.0 else 0.0


def _joined(slot: Slot, place: AntennaPlace, rules: StationRules) -> Slot | None:
    """What is left of a slot when the antenna has come there; None: too little."""
    way_deg = slot.start_deg[0] - place.az_deg, slot.start_deg[1] - place.el_deg
    there_tai_s = place.free_tai_s + rules.slew_s(*way_deg)
    if there_tai_s <= slot.start_tai_s:
        return slot
    offset_deg = slot.start_deg[0] - slot.track.at(slot.start_tai_s)[0]
    useful_s = slot.track.useful_s(there_tai_s, slot.end_tai_s, offset_deg, rules.azimuth)
    if there_tai_s >= slot.end_tai_s or useful_s < slot.track.rules.min_useful_s:
        return None
    az_deg, el_deg = slot.track.at(there_tai_s)
    return replace(slot, start_tai_s=there_tai_s, start_deg=(az_deg + offset_deg, el_deg), useful_s=useful_s)


def _best_chain(slots: Sequence[Slot], extra: Array, rules: StationRules) -> list[Slot]:
    count = len(slots)
    if count == 0:
        return []
    starts, ends = np.array([one.start_tai_s for one in slots]), np.array([one.end_tai_s for one in slots])
    az, el = (np.array([one.end_deg[axis] for one in slots]) for axis in (0, 1))
    best, before = np.zeros(count), np.full(count, -1)
    so_far, so_far_at = np.zeros(count), np.full(count, -1)  # the best chain that ends with a slot up to this one
    for j, slot in enumerate(slots):
        far = int(np.searchsorted(ends, starts[j] - rules.longest_gap_s, side="right"))
        gain, at = (so_far[far - 1], so_far_at[far - 1]) if far else (0.0, -1)
        near = np.arange(far, int(np.searchsorted(ends, starts[j], side="right")))
        if near.size:
            way_az, way_el = np.abs(slot.start_deg[0] - az[near]), np.abs(slot.start_deg[1] - el[near])
            need_s = rules.pre_s + rules.post_s + _slews_s(way_az, way_el, rules)
            is_in_time = ends[near] + need_s <= starts[j]
            reached = np.where(is_in_time, best[near] - TRAVEL_PRICE * (way_az + way_el), -np.inf)
            top = int(np.argmax(reached))
            if reached[top] > gain:
                gain, at = float(reached[top]), int(near[top])
        best[j], before[j] = slot.value + extra[j] + gain, at
        is_better = j == 0 or best[j] > so_far[j - 1]
        so_far[j], so_far_at[j] = (best[j], j) if is_better else (so_far[j - 1], so_far_at[j - 1])
    chain, at = [], int(so_far_at[-1])
    while at >= 0:
        chain.append(slots[at])
        at = int(before[at])
    return chain[::-1]


def _slews_s(way_az_deg: Array, way_el_deg: Array, rules: StationRules) -> Array:
    pairs = zip(way_az_deg.tolist(), way_el_deg.tolist(), strict=True)
    return np.array([rules.slew_s(az_deg, el_deg) for az_deg, el_deg in pairs])


def slots_of(track: PassTrack, tracks: Sequence[PassTrack], rules: StationRules) -> Iterator[Slot]:
    """The whole pass on each of its turns, and the parts worth trying where it may be cut.  Windows are kept clear."""
    starts, ends = _own_starts(track), _own_ends(track)
    if track.rules.may_be_cut:
        for one in rules.windows:
            starts.add(one.to_tai_s + rules.pre_s)
            ends.add(one.from_tai_s - rules.post_s)
        for other in tracks:
            if other is not track and _are_near(track, other, rules.longest_gap_s):
                starts.update(_starts_after(track, other, rules))
                ends.update(_ends_before(track, other, rules))
    for start_tai_s in starts:
        for end_tai_s in ends:
            if track.start_tai_s <= start_tai_s < end_tai_s <= track.end_tai_s:
                yield from _on_turns(track, start_tai_s, end_tai_s, rules)


def _own_starts(track: PassTrack) -> set[float]:
    """Where a slot of a pass may begin, whatever is beside it."""
    latest_tai_s = track.end_tai_s - track.rules.margin_s - track.rules.min_useful_s - STEP_S
    return {track.start_tai_s, latest_tai_s} if track.rules.may_be_cut else {track.start_tai_s}


def _own_ends(track: PassTrack) -> set[float]:
    earliest_tai_s = track.start_tai_s + track.rules.margin_s + track.rules.min_useful_s + STEP_S
    return {track.end_tai_s, earliest_tai_s} if track.rules.may_be_cut else {track.end_tai_s}


def _are_near(track: PassTrack, other: PassTrack, gap_s: float) -> bool:
    return other.start_tai_s - gap_s < track.end_tai_s and track.start_tai_s < other.end_tai_s + gap_s


def _on_turns(track: PassTrack, start_tai_s: float, end_tai_s: float, rules: StationRules) -> Iterator[Slot]:
    if rules.window_in_the_way(start_tai_s, end_tai_s) is not None:
        return
    start_deg, end_deg = track.at(start_tai_s), track.at(end_tai_s)
    for offset_deg in track.turns_deg(start_tai_s, end_tai_s, rules.azimuth):
        useful_s = track.useful_s(start_tai_s, end_tai_s, offset_deg, rules.azimuth)
        if useful_s < track.rules.min_useful_s:
            continue
        yield Slot(
            track,
            start_tai_s,
            end_tai_s,
            (start_deg[0] + offset_deg, start_deg[1]),
            (end_deg[0] + offset_deg, end_deg[1]),
            useful_s,
        )


def _starts_after(track: PassTrack, other: PassTrack, rules: StationRules) -> Iterator[float]:
    """When a part of the track can begin after another pass, for each pair of turns; to a second, not earlier."""
    for left_tai_s in _own_ends(other):
        left_deg = other.at(left_tai_s)
        for turn_deg in _turn_differences(track, other, rules):
            begin_tai_s = left_tai_s
            for _ in range(CUT_ROUNDS):
                at_deg = track.at(begin_tai_s)
                slew_s = rules.slew_s(at_deg[0] + turn_deg - left_deg[0], at_deg[1] - left_deg[1])
                begin_tai_s = max(begin_tai_s, left_tai_s + rules.post_s + rules.pre_s + slew_s)
            yield float(np.ceil(begin_tai_s + 1e-3))


def _ends_before(track: PassTrack, other: PassTrack, rules: StationRules) -> Iterator[float]:
    """When a part of the track must end for another pass, for each pair of turns; to a second, not later."""
    for next_tai_s in _own_starts(other):
        next_deg = other.at(next_tai_s)
        for turn_deg in _turn_differences(track, other, rules):
            end_tai_s = next_tai_s
            for _ in range(CUT_ROUNDS):
                at_deg = track.at(end_tai_s)
                slew_s = rules.slew_s(at_deg[0] + turn_deg - next_deg[0], at_deg[1] - next_deg[1])
                end_tai_s = min(end_tai_s, next_tai_s - rules.post_s - rules.pre_s - slew_s)
            yield float(np.floor(end_tai_s - 1e-3))


def _turn_differences(track: PassTrack, other: PassTrack, rules: StationRules) -> set[float]:
    """By how much the turns of two passes may differ, degrees."""
    own, others = (one.turns_deg(one.start_tai_s, one.end_tai_s, rules.azimuth) for one in (track, other))
    return {turn - other_turn for turn in own for other_turn in others}

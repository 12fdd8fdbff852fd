"""The plan as people read it: every pass with its state and, where it is not granted, why not."""

from collections.abc import Sequence
from dataclasses import dataclass

from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.exact_plan import AntennaPlace, Slot, best_slots, slots_of
from acu_daemon.schedule.pass_track import PassTrack
from acu_daemon.schedule.rules import PassRequest, StationRules, Wish

RESUMED = "gone on with after a restart"
MUST: dict[Wish | None, str] = {Wish.FORCE: "forced by a person", Wish.GO_ON: RESUMED}


@dataclass(frozen=True, slots=True)
class Decision:
    """What the schedule says of a pass; slot None: refused, and why."""

    track: PassTrack
    slot: Slot | None
    reason: str = ""


def decide(
    tracks: Sequence[PassTrack], rules: StationRules, *, frozen: Sequence[Slot] = (), place: AntennaPlace | None = None
) -> list[Decision]:
    """Grant and refuse passes, in order of their rise; arguments as those of best_slots."""
    held = {id(slot.track): slot for slot in frozen}
    refused = {id(one): reason for one in tracks if id(one) not in held and (reason := _never(one, rules))}
    open_tracks = [one for one in tracks if id(one) not in refused]
    forced = [one for one in open_tracks if _wish(one, rules.requests) in MUST]
    chosen = best_slots(open_tracks, rules, frozen=frozen, forced=forced, place=place)
    granted: dict[int, list[Slot]] = {}
    for slot in chosen:
        granted.setdefault(id(slot.track), []).append(slot)
    decisions = []
    for track in tracks:
        if id(track) in refused:
            decisions.append(Decision(track, None, refused[id(track)]))
        elif id(track) in granted:
            decisions += [Decision(track, slot, _granted_text(slot, rules)) for slot in granted[id(track)]]
        else:
            decisions.append(Decision(track, None, _lost_text(track, chosen, rules, place)))
    return sorted(decisions, key=lambda one: (one.track.start_tai_s, one.track.satellite))


def _wish(track: PassTrack, requests: Sequence[PassRequest]) -> Wish | None:
    """The newest word about a pass."""
    coming = track.coming
    times = coming.rise_tai_s, coming.culmination_tai_s, coming.set_tai_s
    said = [one.wish for one in requests if one.is_of(track.satellite, *times)]
    return said[-1] if said else None


def _never(track: PassTrack, rules: StationRules) -> str:
    """Why a pass is not tracked whatever is beside it; empty: it may be."""
    wish = _wish(track, rules.requests)
    if wish is Wish.EXCLUDE:
        return "excluded by a person"
    top_deg, least_deg = track.coming.culmination_el_deg, track.rules.min_culmination_deg
    if top_deg < least_deg and wish not in MUST:
        return f"culminates at {top_deg:.1f} deg, min_culmination_deg is {least_deg:g}"
    if next(slots_of(track, (), rules), None) is not None:
        return ""
    if (window := rules.window_in_the_way(track.start_tai_s, track.end_tai_s)) is not None:
        return f"{window.reason} {_clock(window.from_tai_s)} to {_clock(window.to_tai_s)}"
    turns_deg = track.turns_deg(track.start_tai_s, track.end_tai_s, rules.azimuth)
    most_s = max(track.useful_s(track.start_tai_s, track.end_tai_s, turn, rules.azimuth) for turn in turns_deg)
    return f"useful for {most_s:.0f} s only, min_useful_s is {track.rules.min_useful_s:g}"


def _granted_text(slot: Slot, rules: StationRules) -> str:
    wish = _wish(slot.track, rules.requests)
    said = [MUST[wish]] if wish in MUST else []
    if slot.is_cut:
        said.append(f"cut to {_clock(slot.start_tai_s)} to {_clock(slot.end_tai_s)}")
    return ", ".join(said)


def _lost_text(track: PassTrack, chosen: Sequence[Slot], rules: StationRules, place: AntennaPlace | None) -> str:
    """To which granted pass it was lost: that with the most of its time, else the one that is too near."""
    overlap_s, other = max(
        ((min(track.end_tai_s, one.end_tai_s) - max(track.start_tai_s, one.start_tai_s), one) for one in chosen),
        key=lambda pair: pair[0],
        default=(0.0, None),
    )
    if other is None or overlap_s < -rules.longest_gap_s:
        if place is not None and place.free_tai_s > track.start_tai_s:
            return "it is too late to be there for its rise"
        return "the antenna cannot be there in time"
    whom = f"{other.track.satellite} of {_clock(other.start_tai_s)} (priority {other.track.rules.priority})"
    if overlap_s > 0.0:
        return f"lost to {whom}: both are up for {overlap_s:.0f} s"
    is_before = other.end_tai_s <= track.start_tai_s
    need_s = rules.pre_s + rules.post_s + _least_slew_s(track, other, rules, is_before=is_before)
    return f"lost to {whom}: slew and preparation need {need_s:.0f} s, the gap is {abs(overlap_s):.0f} s"


def _least_slew_s(track: PassTrack, other: Slot, rules: StationRules, *, is_before: bool) -> float:
    mine_deg = track.at(track.start_tai_s if is_before else track.end_tai_s)
    its_deg = other.end_deg if is_before else other.start_deg
    turns_deg = track.turns_deg(track.start_tai_s, track.end_tai_s, rules.azimuth)
    return min(rules.slew_s(mine_deg[0] + turn - its_deg[0], mine_deg[1] - its_deg[1]) for turn in turns_deg)


def _clock(tai_s: float) -> str:
    return utc_text(tai_s, 0)[11:19]

"""Every pass with its state, from planned to done, and what a new plan changes.  Nothing is deleted; ages go by.

            planned --> prepass --> pass --> postpass --> done | degraded | failed
            |  ^  \\
            v  |   `--> missed (its time went by) | cancelled (by a person, or gone from the plan)
            refused
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.decisions import RESUMED, Decision
from acu_daemon.schedule.rules import SAME_PASS_S

TOLD_S = 5.0  # a reservation that moves less is not worth a word


class PassState(StrEnum):
    """Where a pass is in its life."""

    PLANNED = "planned"
    REFUSED = "refused"
    PREPASS = "prepass"
    PASS = "pass"
    POSTPASS = "postpass"
    DONE = "done"
    DEGRADED = "degraded"
    FAILED = "failed"
    MISSED = "missed"
    CANCELLED = "cancelled"


OPEN = (PassState.PLANNED, PassState.REFUSED)  # what a plan may still change
OVER = (PassState.DONE, PassState.DEGRADED, PassState.FAILED, PassState.MISSED, PassState.CANCELLED)
UNDER_WAY = (PassState.PREPASS, PassState.PASS, PassState.POSTPASS)


@dataclass(frozen=True, slots=True)
class Entry:
    """A pass, or a part of one; times TAI s.  start, end: the reservation, None where it was never granted."""

    satellite: str
    rise_tai_s: float
    culmination_tai_s: float
    set_tai_s: float
    culmination_el_deg: float
    priority: int
    state: PassState
    reason: str
    useful_s: float = 0.0
    start_tai_s: float | None = None
    end_tai_s: float | None = None
    start_az_deg: float | None = None  # on which turn of the cable wrap it was planned
    part: int = 0  # of a pass that is granted in several
    number: int = 0

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.satellite} of {utc_text(self.rise_tai_s, 0)[:19]}Z"

    @property
    def is_resumed(self) -> bool:
        """Whether it was on when the daemon was killed: checked, and the antenna may be on it still."""
        return self.reason.startswith(RESUMED)


@dataclass(frozen=True, slots=True)
class Merged:
    """The book after a new plan.  changed: the entries that differ, said: the difference in words."""

    book: tuple[Entry, ...]
    changed: tuple[Entry, ...]
    said: tuple[str, ...]


def merged(
    book: Sequence[Entry], decisions: Sequence[Decision], now_tai_s: float, until_tai_s: float, first_number: int = 1
) -> Merged:
    """Take a new plan, which covers now to until, into the book.  first_number: for the entries that are new."""
    rest = list(book)
    kept: list[Entry] = []
    changed: list[Entry] = []
    said: list[str] = []
    parts: dict[int, int] = {}
    for decision in decisions:
        part = parts[id(decision.track)] = parts.get(id(decision.track), -1) + 1
        new = _entry(decision, part)
        old = next((one for one in rest if _is_same(one, new)), None)
        if old is None:
            new = replace(new, number=first_number)
            first_number += 1
            kept.append(new)
            changed.append(new)
            said += [f"{new.name}: {_words(new)}"] if new.state is PassState.PLANNED and book else []
            continue
        rest.remove(old)
        if old.state not in OPEN:
            kept.append(old)
            continue
        new = replace(new, number=old.number)
        kept.append(new)
        if new != old:
            changed.append(new)
        if (words := _difference(old, new)) != "":
            said.append(f"{new.name}: {words}")
    for old in rest:
        gone = _gone(old, now_tai_s, until_tai_s)
        kept.append(gone)
        if gone != old:
            changed.append(gone)
            said.append(f"{gone.name}: {_words(gone)}")
    kept.sort(key=lambda one: (one.rise_tai_s, one.satellite, one.part))
    return Merged(tuple(kept), tuple(changed), tuple(said))


def _entry(decision: Decision, part: int) -> Entry:
    coming, slot = decision.track.coming, decision.slot
    entry = Entry(
        decision.track.satellite,
        coming.rise_tai_s,
        coming.culmination_tai_s,
        coming.set_tai_s,
        coming.culmination_el_deg,
        decision.track.rules.priority,
        PassState.REFUSED if slot is None else PassState.PLANNED,
        decision.reason,
        part=part,
    )
    if slot is None:
        return entry
    return replace(
        entry,
        useful_s=slot.useful_s,
        start_tai_s=slot.start_tai_s,
        end_tai_s=slot.end_tai_s,
        start_az_deg=slot.start_deg[0],
    )


def _is_same(one: Entry, other: Entry) -> bool:
    is_near = abs(one.culmination_tai_s - other.culmination_tai_s) < SAME_PASS_S
    return one.satellite == other.satellite and one.part == other.part and is_near


def _difference(old: Entry, new: Entry) -> str:
    """What of an entry people should hear of; empty: nothing."""
    if old.state is not new.state:
        return f"{_words(new)}, was {old.state}"
    if new.start_tai_s is None or old.start_tai_s is None or new.end_tai_s is None or old.end_tai_s is None:
        return ""
    moved_s = max(abs(new.start_tai_s - old.start_tai_s), abs(new.end_tai_s - old.end_tai_s))
    return "" if moved_s < TOLD_S else f"moved by up to {moved_s:.0f} s"


def _gone(old: Entry, now_tai_s: float, until_tai_s: float) -> Entry:
    """An entry that the new plan does not have."""
    if old.state is PassState.PLANNED and old.set_tai_s < now_tai_s and old.is_resumed:
        return replace(old, state=PassState.FAILED, reason="the daemon ended in mid-pass, and came back too late")
    if old.state is PassState.PLANNED and old.set_tai_s < now_tai_s:
        return replace(old, state=PassState.MISSED, reason=old.reason or "the daemon did not run, or was not ready")
    if old.state in UNDER_WAY and old.set_tai_s < now_tai_s:
        return replace(old, state=PassState.FAILED, reason="the daemon ended in mid-pass")
    if old.state is PassState.PLANNED and old.rise_tai_s < until_tai_s:
        return replace(old, state=PassState.CANCELLED, reason="no longer in the plan: its satellite or elements went")
    return old


def _words(entry: Entry) -> str:
    return f"{entry.state} ({entry.reason})" if entry.reason else str(entry.state)


def paused(entry: Entry, until_tai_s: float) -> Entry:
    """An entry as a pause leaves it."""
    if entry.state is not PassState.PLANNED or entry.start_tai_s is None or entry.start_tai_s >= until_tai_s:
        return entry
    reason = f"paused by a person until {utc_text(until_tai_s, 0)}"
    return replace(entry, state=PassState.CANCELLED, reason=reason)

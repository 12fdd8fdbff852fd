"""What every page is shown: texts by topic, each put into JSON once for all who look, and never a queue of them.

A topic has a version.  Whoever has an older one is sent the newest; what came between is sent to nobody.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from enum import StrEnum
from typing import Any, Protocol

import numpy as np

from acu_daemon.daemon.drawing import Aim, Backdrop, PathAhead
from acu_daemon.daemon.overview import headline, steering
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms, verdict
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.units import Array
from acu_daemon.web import alarm_book
from acu_daemon.web.alarm_book import AlarmBook
from acu_daemon.web.order_desk import verbs_shown
from acu_daemon.web.pass_story import PassStory
from acu_daemon.web.recent_events import RecentEvents

AHEAD_EVERY_S = 1.0
EVENTS_EVERY_S = 0.5
SELDOM_S = 5.0
LATENESS_TICKS = 6000  # the newest ten minutes
LATENESS_EDGES_MS = (0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
SNAPSHOT_KEYS = tuple(one.name for one in fields(Snapshot))
DIGITS = 5
MOST_SHARED = 20
FIRST_TICKS = 30


class Topic(StrEnum):
    """What is told apart."""

    NOW = "now"
    BACKDROP = "backdrop"
    AHEAD = "ahead"
    STATES = "states"
    EVENTS = "events"
    ALARMS = "alarms"
    LATENESS = "lateness"
    SCHEDULE = "schedule"
    PEOPLE = "people"


class Watched(Protocol):
    """The daemon, as the page sees it; None: it has nothing to show yet."""

    is_station: bool

    def answer(self, line: str, who: str = "") -> str: ...

    def aim(self) -> Aim | None: ...

    def path_ahead(self) -> PathAhead | None: ...

    def backdrop(self) -> Backdrop | None: ...

    def lateness_ms(self, most: int) -> Array: ...

    def passes(self) -> list[dict[str, Any]]: ...


@dataclass(frozen=True, slots=True)
class _Text:
    version: int
    json: str


class Feed:
    """Owned by the loop.  on_news is called after each update; while nobody looks, nothing is made."""

    def __init__(
        self, watched: Watched, events: RecentEvents, lease: WriteLease, now_s: Callable[[], float], *, may_order: bool
    ) -> None:
        self._watched, self._events, self._lease, self._now_s = watched, events, lease, now_s
        self._may_order = may_order
        self._texts: dict[Topic, _Text] = {}
        self._made_s: dict[Topic, float] = {}
        self._version = 0
        self._shared: dict[tuple[int, ...], str] = {}
        self._story, self._book, self._event_count = PassStory(), AlarmBook(), -1
        self._drawn: Backdrop | None = None
        self.on_news: Callable[[], None] = lambda: None
        self.names: Callable[[], list[str]] = list
        self.is_watched = False

    def see(self, seen: Snapshot) -> None:
        """Take the newest snapshot."""
        self._story.see(seen)
        self._book = alarm_book.seen(self._book, alarms_shown(seen), seen.utc)
        if self.is_watched:
            self._put(Topic.NOW, self._now(seen))
            self.refresh()

    def refresh(self) -> None:
        """Make anew what has changed beside the snapshot, each as seldom as may be, and tell of it."""
        backdrop = self._watched.backdrop()
        if backdrop is not self._drawn or Topic.BACKDROP not in self._texts:
            self._drawn = backdrop
            self._put(Topic.BACKDROP, None if backdrop is None else asdict(backdrop))
        if self._is_time(Topic.AHEAD, AHEAD_EVERY_S):
            ahead = self._watched.path_ahead()
            self._put(Topic.AHEAD, None if ahead is None else asdict(ahead))
        if self._event_count != self._events.count and self._is_time(Topic.EVENTS, EVENTS_EVERY_S):
            self._event_count = self._events.count
            self._put(Topic.EVENTS, self._events.lines())
        if self._is_time(Topic.LATENESS, SELDOM_S):
            self._put(Topic.LATENESS, self._lateness())
            self._put(Topic.SCHEDULE, self._watched.passes())
        self._put(Topic.STATES, [asdict(one) for one in self._story.stretches])
        self._put(Topic.ALARMS, [asdict(one) for one in alarm_book.in_order(self._book)])
        self._put(Topic.PEOPLE, self._people())
        self.on_news()

    def acknowledge(self, number: int, by: str) -> None:
        """Somebody has seen an alarm."""
        self._book = alarm_book.acknowledged(self._book, number, by)
        self.refresh()

    def verbs(self) -> list[dict[str, Any]]:
        """What may be ordered here."""
        return verbs_shown(is_station=self._watched.is_station)

    def strip(self) -> str:
        """The last minutes, for a page that has just been opened."""
        return to_json(list(self._story.strip))

    def news(self, known: Mapping[Topic, int]) -> tuple[str, dict[Topic, int]]:
        """What is new to whoever knows those versions, as the inside of a JSON object, and what is known then."""
        new = {topic: text for topic, text in self._texts.items() if known.get(topic) != text.version}
        key = tuple(text.version for text in new.values())
        if key not in self._shared:
            if len(self._shared) >= MOST_SHARED:
                self._shared.clear()
            self._shared[key] = ",".join(f'"{topic}":{text.json}' for topic, text in new.items())
        return self._shared[key], {**known, **{topic: text.version for topic, text in new.items()}}

    def _now(self, seen: Snapshot) -> dict[str, Any]:
        said, aim = verdict(seen), self._watched.aim()
        return {key: getattr(seen, key) for key in SNAPSHOT_KEYS} | {
            "verdict": said.word,
            "level": said.level.name,
            "why": said.why,
            "headline": headline(seen),
            "steering": steering(seen),
            "aim": None if aim is None else asdict(aim),
            "lease_left_s": self._lease.left_s(),
        }

    def _people(self) -> dict[str, Any]:
        held = self._lease.held
        claim = None if held is None else held.claim
        lease = None if claim is None else {"name": claim.name, "via": claim.via, "reason": claim.reason}
        return {"lease": lease, "names": self.names(), "may_order": self._may_order}

    def _lateness(self) -> dict[str, Any]:
        late_ms = self._watched.lateness_ms(LATENESS_TICKS)
        counts, _ = np.histogram(np.maximum(late_ms, 0.0), [*LATENESS_EDGES_MS, math.inf])
        return {"edges_ms": LATENESS_EDGES_MS, "counts": counts.tolist()}

    def _is_time(self, topic: Topic, every_s: float) -> bool:
        now_s = self._now_s()
        if now_s - self._made_s.get(topic, -math.inf) < every_s:
            return False
        self._made_s[topic] = now_s
        return True

    def _put(self, topic: Topic, value: Any) -> None:
        text, old = to_json(value), self._texts.get(topic)
        if old is None or old.json != text:
            self._version += 1
            self._texts[topic] = _Text(self._version, text)


def alarms_shown(seen: Snapshot) -> list[str]:
    """The alarms; who has disarmed it is said alike in every state, and at the start nothing is known yet."""
    if seen.az_deg is None and seen.tick_count < FIRST_TICKS:
        return []
    return [f"DISARMED by {text}" if text == seen.disarmed_by else text for text in alarms(seen)]


def to_json(value: Any) -> str:
    """JSON in one line; what is not finite is null."""
    return json.dumps(_plain(value), separators=(",", ":"))


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, DIGITS) if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value

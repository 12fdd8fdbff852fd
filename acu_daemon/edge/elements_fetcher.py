"""The station's one fetcher of elements: asks the servers that are due, looks at what comes, keeps what is better.

It runs in a process of its own (`acu-daemon elements fetch`), started by the daemon or by a timer; a lock in the store
lets in one at a time.  An answer that is not what was asked for changes nothing but the state of its URL.
"""

import asyncio
import fcntl
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

from acu_daemon.edge.elements_store import KeptSet, WantedSatellite, keep_set
from acu_daemon.edge.fetch_policy import Came, FetchOutcome, FetchState, after, before_asking, is_due, is_news
from acu_daemon.edge.fetch_state_file import LONGEST_TEXT, group_file, read_fetch_state, write_fetch_state
from acu_daemon.edge.orbit_file import EPHEMERIS_PARSERS, GZIP, SET_PARSERS, contents_of
from acu_daemon.edge.writer import replace_file
from acu_daemon.errors import ElementsError
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.named_sets import named_sets
from acu_daemon.orbit.selection import select_segments
from acu_daemon.orbit.set_judgement import Judged
from acu_daemon.orbit.timescales import utc_text

LOCK = ".fetch.lock"


class Asker(Protocol):
    """Asks a server once: elements_request.ask_server with its settings."""

    async def __call__(self, state: FetchState) -> tuple[FetchOutcome, bytes]: ...


@dataclass(frozen=True, slots=True)
class Told:
    """An event for the log."""

    event: str
    is_warning: bool
    fields: dict[str, Any] = field(default_factory=dict)


@contextmanager
def one_at_a_time(store: Path) -> Iterator[bool]:
    """Whether this process is the only one that fetches into a store.  OSError: the store cannot be written."""
    store.mkdir(parents=True, exist_ok=True)
    with (store / LOCK).open("a") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        yield True


async def fetch_due(
    store: Path,
    urls: Sequence[str],
    satellites: Sequence[WantedSatellite],
    every_s: float,
    clock_tai_s: Callable[[], float],
    ask: Asker,
) -> list[Told]:
    """Ask every URL that is due, one after another; returns what people are told.

    OSError: the state cannot be written: then nobody is asked, since nobody would know when it was.
    """
    told: list[Told] = []
    for url in urls:
        state = read_fetch_state(store, url)
        if is_due(state, clock_tai_s(), every_s):
            told += await _fetch(store, state, satellites, every_s, clock_tai_s, ask)
    return told


async def _fetch(
    store: Path,
    before: FetchState,
    satellites: Sequence[WantedSatellite],
    every_s: float,
    clock_tai_s: Callable[[], float],
    ask: Asker,
) -> list[Told]:
    write_fetch_state(store, before_asking(before, clock_tai_s(), every_s))
    has_group = group_file(store, before.url).exists()
    outcome, data = await ask(before if has_group else replace(before, last_modified="", etag=""))
    kept: list[KeptSet] = []
    if outcome.came is Came.GOOD:
        outcome, kept = await asyncio.to_thread(_accepted, store, before.url, outcome, data, satellites, clock_tai_s())
    outcome = replace(outcome, reason=outcome.reason[:LONGEST_TEXT])
    later = after(before, outcome, clock_tai_s(), every_s)
    if outcome.came is Came.GOOD:
        not_taken = "; ".join(f"{one.satellite.name}: {one.reason}" for one in kept if one.reason)
        later = replace(later, not_taken=not_taken[:LONGEST_TEXT])
    write_fetch_state(store, later)
    told = [_told_of(before.url, outcome, later, kept)] if is_news(before, later, outcome) else []
    if later.not_taken and later.not_taken != before.not_taken:
        told += [_told_of_set(before.url, one) for one in kept if one.reason]
    return told


def _accepted(
    store: Path, url: str, outcome: FetchOutcome, data: bytes, satellites: Sequence[WantedSatellite], now_tai_s: float
) -> tuple[FetchOutcome, list[KeptSet]]:
    """Look at an answer and keep what is good in it; the outcome says why nothing is."""
    try:
        if data.startswith(GZIP) and not urlsplit(url).path.endswith(".gz"):
            raise ElementsError("packed by gzip without saying so")
        kind, text = contents_of(data, Path("the answer"))
        if kind in EPHEMERIS_PARSERS:
            _check_ephemeris(kind, text, satellites, group_file(store, url))
            kept = []
        else:
            found = _wanted_sets(kind, text, satellites)
            kept = [keep_set(store, satellite, one, url, now_tai_s) for satellite, one in found]
            if kept and all(one.judgement is None or one.judgement.judged is Judged.OLDER for one in kept):
                raise ElementsError(f"nothing better in it: {kept[0].elements.label}: {kept[0].reason}")
        replace_file(group_file(store, url), data)
    except ElementsError as error:
        reason = str(error).removeprefix("the answer: ").splitlines()[0]
        return replace(outcome, came=Came.UNUSABLE, reason=reason), []
    except OSError as error:
        return replace(outcome, came=Came.UNUSABLE, reason=f"{store}: {error.strerror}"), []
    return outcome, kept


def _wanted_sets(
    kind: str, text: str, satellites: Sequence[WantedSatellite]
) -> list[tuple[WantedSatellite, ElementSet]]:
    """The newest set of each satellite that is in an answer.  ElementsError: none is, or the answer was cut."""
    if text.lstrip()[:1] in ("[", "{"):
        try:
            json.loads(text)
        except (ValueError, RecursionError) as error:
            raise ElementsError(f"JSON that was cut or damaged: {error}") from None
    whole: list[ElementSet] | None = None
    found = []
    for satellite in satellites:
        sets, _ = named_sets("tle" if kind == "tle" else "omm", text, "the answer", satellite.norad_id)
        if not sets:
            if whole is None:
                whole, _ = SET_PARSERS[kind](text, "the answer")
            sets = [one for one in whole if one.norad_id == satellite.norad_id]
        if sets:
            found.append((satellite, max(sets, key=lambda one: one.epoch_tai_s)))
    if not found:
        numbers = ", ".join(f"{one.name} ({one.norad_id})" for one in satellites[:5])
        labels = [one.label for one in whole or []]
        held = f"it holds {len(labels)}, such as {', '.join(labels[:2])}" if labels else "no set in it can be read"
        raise ElementsError(f"none of this station's satellites in it ({numbers}); {held}")
    return found


def _check_ephemeris(kind: str, text: str, satellites: Sequence[WantedSatellite], before: Path) -> None:
    """ElementsError: it is of no satellite of the station, or ends before the one that is kept."""
    segments, problems = EPHEMERIS_PARSERS[kind](text, "the answer")
    if not segments:
        raise ElementsError(str(problems[0]))
    found = []
    for satellite in satellites:
        try:
            found += select_segments(segments, satellite.norad_id, satellite.name, is_whole=False)[0]
        except ElementsError:
            continue
    if not found:
        raise ElementsError(f"an ephemeris of {segments[0].label}, of none of this station's satellites")
    end_tai_s = max(one.end_tai_s for one in found)
    try:
        old, _ = EPHEMERIS_PARSERS[kind](contents_of(before.read_bytes(), before)[1], str(before))
    except (OSError, ElementsError):
        return
    if old and end_tai_s < max(one.end_tai_s for one in old):
        raise ElementsError(f"older than what is kept: the ephemeris ends at {utc_text(end_tai_s, 0)}")


def _told_of(url: str, outcome: FetchOutcome, later: FetchState, kept: list[KeptSet]) -> Told:
    next_utc = utc_text(later.next_tai_s, 0)
    match outcome.came:
        case Came.GOOD | Came.UNCHANGED:
            new = {one.satellite.name: utc_text(one.elements.epoch_tai_s, 0) for one in kept if not one.reason}
            said = {"unchanged": True} if outcome.came is Came.UNCHANGED else {"epochs": new}
            return Told("elements.fetched", False, {"url": url, **said, "next": next_utc})
        case Came.REFUSED:
            action = "nobody asks any more until `acu-daemon elements resume`; look at the URL first"
            return Told("elements.fetch_stopped", True, {"url": url, "reason": outcome.reason, "action": action})
    return Told("elements.fetch_failed", True, {"url": url, "reason": outcome.reason, "next": next_utc})


def _told_of_set(url: str, kept: KeptSet) -> Told:
    """A set that is not taken."""
    event = "elements.doubtful" if kept.judgement and kept.judgement.judged is Judged.DOUBTFUL else "elements.not_taken"
    epoch = utc_text(kept.elements.epoch_tai_s, 0)
    return Told(event, True, {"satellite": kept.satellite.name, "epoch": epoch, "reason": kept.reason, "url": url})

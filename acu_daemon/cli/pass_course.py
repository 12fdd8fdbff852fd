"""The course of the pass that is on: what was seen of it, what hooks hear of that, and how it came out."""

import math
import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import structlog

from acu_daemon.cli.schedule_keeper import ScheduleKeeper
from acu_daemon.control.phantom import PhantomPass
from acu_daemon.daemon.service import Outcome
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms
from acu_daemon.edge.hooks import Hook, HookResult, Hooks
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.schedule.decisions import RESUMED

EARLY_KEPT = 32
DEGRADED_SHARE = 0.5  # of the useful seconds with the signal
FIGURES = re.compile(r"[-+]?\d[\d.:]*")
NO_SIGNAL = "no signal: the satellite was silent, or not where it should be"


@dataclass(frozen=True, slots=True)
class KeptNudge:
    """What a person moves a satellite's path by, s late and deg right, and the elements for which that holds."""

    along_s: float
    across_deg: float
    elements: str


@dataclass(slots=True)
class Tracked:
    """What was seen of the pass that is on."""

    locked_s: float = 0.0
    on_path_s: float = 0.0
    is_told_of_signal: bool = True
    was_acquired: bool = False
    last_tai_s: float = math.nan
    first_tai_s: float = math.nan  # of a pass that was gone on with: of what was before nothing is known
    words: list[str] = field(default_factory=list)  # what else there is to say of it, each once
    hooks: list[HookResult] = field(default_factory=list)
    cancelled_by: str = ""
    phantom: PhantomPass | None = None
    nudge: KeptNudge | None = None  # in force now
    is_nudge_kept: bool = False

    def note(self, word: str) -> None:
        """Remember something to say."""
        if word not in self.words:
            self.words.append(word)


class PassCourse:
    """Owned by the loop.  entry: the pass that is on; None: none is."""

    def __init__(self, keeper: ScheduleKeeper, hooks: Hooks, about: Callable[[Entry], dict[str, Any]]) -> None:
        self._keeper, self._hooks, self._about = keeper, hooks, about
        self._tracked = Tracked()
        self._alarms: dict[str, str] = {}  # by their texts without figures, such as since when they last
        self.entry: Entry | None = None
        self.record: dict[str, Any] = {}  # of the pass that is over, for its report; JSON
        self._early: deque[HookResult] = deque(maxlen=EARLY_KEPT)  # of passes that have not begun
        self._nudges: dict[str, KeptNudge] = {}  # of satellites, until the process ends
        self._log: Any = structlog.get_logger("station")

    def begun(self, entry: Entry, phantom: PhantomPass | None) -> None:
        """The run of a pass begins.  phantom: what was found of it before."""
        self._tracked = Tracked(phantom=phantom)
        self._tracked.hooks += [one for one in self._early if one.number == entry.number]
        if entry.is_resumed:
            self._tracked.note(RESUMED)
        self.entry = self._keeper.change(entry, PassState.PREPASS, "")
        self._hooks.call(Hook.BEFORE_PASS, self._about(entry))
        self._hooks.call(Hook.DURING_PASS, self._about(entry))

    def see(self, seen: Snapshot) -> None:
        """Take the newest snapshot, of a pass or between passes."""
        before, self._alarms = self._alarms, {FIGURES.sub("", text): text for text in alarms(seen)}
        if begun := sorted(text for kind, text in self._alarms.items() if kind not in before):
            about = {"alarms": begun} | (self._about(self.entry) if self.entry else {})
            self._hooks.call(Hook.ON_ALARM, about)
        self.gather()
        if self.entry is not None:
            self._see_pass(self.entry, seen)

    @property
    def hook_results(self) -> list[HookResult]:
        """How the hooks of the pass ended, so far."""
        return self._tracked.hooks

    def gather(self) -> None:
        """Put how hooks ended to the pass that is on, to the one that is over, or to those that are to come."""
        entry = self.entry
        for result in self._hooks.take_results():
            if entry is not None and result.number in (entry.number, 0):
                self._tracked.hooks.append(result)
                if not result.is_good:
                    self._tracked.note(f"hook {result.hook}: {result.problem}")
            elif self.record and result.number == self.record["number"]:
                self.record["hooks"].append(result.record)
            elif result.number:
                self._early.append(result)

    def _see_pass(self, entry: Entry, seen: Snapshot) -> None:
        tracked = self._tracked
        is_nudged = seen.nudge_along_s != 0.0 or seen.nudge_across_deg != 0.0
        nudge = KeptNudge(seen.nudge_along_s, seen.nudge_across_deg, seen.elements)
        tracked.nudge = nudge if is_nudged else None
        if seen.is_held_by_person:
            tracked.note("held by a person")
        if seen.stow_by:
            tracked.note(f"stowed by the {seen.stow_by}")
        if entry.state is PassState.PREPASS and seen.rise_in_s is not None and seen.rise_in_s <= 0.0:
            self.entry = entry = self._keeper.change(entry, PassState.PASS, "")
        tracked.is_told_of_signal = seen.is_told_of_signal
        if math.isnan(tracked.last_tai_s):
            tracked.first_tai_s = seen.tai_s
        else:
            tracked.locked_s += (seen.tai_s - tracked.last_tai_s) * seen.is_acquired
            is_on_path = entry.state is PassState.PASS and seen.is_on_path is True
            tracked.on_path_s += (seen.tai_s - tracked.last_tai_s) * is_on_path
        tracked.last_tai_s = seen.tai_s
        if seen.is_acquired != tracked.was_acquired:
            tracked.was_acquired = seen.is_acquired
            self._hooks.call(Hook.AT_LOCK if seen.is_acquired else Hook.AT_LOSS, self._about(entry))

    def ended(self, outcome: Outcome | None, reason: str = "") -> None:
        """The run of a pass is over; outcome None: it ended by an error, the reason."""
        if self.entry is None:
            return
        self.gather()
        entry = self._keeper.change(self.entry, PassState.POSTPASS, "")
        self._keep_nudge(entry.satellite)
        state, why = self._judged(entry, outcome, reason)
        changed = self._keeper.change(entry, state, why)
        self._hooks.end_during()
        self.record = self._about(changed) | self._recorded(state, why)
        self._hooks.call(Hook.AFTER_PASS, self.record | {"hooks": list(self.record["hooks"])})
        self._log.info("pass.done", entry=changed.name, state=str(state), reason=why)
        self.entry = None

    # People

    def cancel(self, who: str) -> None:
        """A person gives the pass up."""
        self._tracked.cancelled_by = who or "a person"

    def note(self, word: str) -> None:
        """Remember something to say of the pass that is on."""
        self._tracked.note(word)

    def keep_nudge(self) -> None:
        """The nudge that is in force at the end begins the satellite's next passes too."""
        self._tracked.is_nudge_kept = True

    def nudge_for(self, satellite: str, elements: str) -> KeptNudge | None:
        """What a pass begins with; None: other elements are in force, or nothing was kept."""
        kept = self._nudges.get(satellite)
        return kept if kept is not None and kept.elements == elements else None

    def _keep_nudge(self, satellite: str) -> None:
        tracked = self._tracked
        if tracked.is_nudge_kept and tracked.nudge is not None:
            self._nudges[satellite] = tracked.nudge
        elif tracked.is_nudge_kept or tracked.nudge is None:  # undone, or what it mended is in a fit
            self._nudges.pop(satellite, None)

    def _recorded(self, state: PassState, why: str) -> dict[str, Any]:
        tracked = self._tracked
        return {
            "state": str(state),
            "reason": why,
            "locked_s": round(tracked.locked_s, 1),
            "phantom": None if tracked.phantom is None else tracked.phantom.record,
            "hooks": [one.record for one in tracked.hooks],
        }

    def _judged(self, entry: Entry, outcome: Outcome | None, reason: str) -> tuple[PassState, str]:
        if outcome is None:
            return PassState.FAILED, reason
        if self._tracked.cancelled_by:
            return PassState.CANCELLED, f"skipped by {self._tracked.cancelled_by}"
        tracked, words = self._tracked, "; ".join(self._tracked.words)
        cause = words or "; ".join(sorted(self._alarms.values()))
        if not tracked.is_told_of_signal:
            state, said = self._judged_by_path(entry, cause)
        elif not outcome.has_acquired and tracked.locked_s == 0.0:
            return PassState.FAILED, f"never acquired: {cause or NO_SIGNAL}"
        else:
            useful_s = self._useful_s(entry)
            said = f"signal for {tracked.locked_s:.0f} of {useful_s:.0f} useful seconds"
            is_degraded = useful_s <= 0.0 or tracked.locked_s / useful_s < DEGRADED_SHARE
            state = PassState.DEGRADED if is_degraded else PassState.DONE
        return state, said if state is PassState.FAILED else "; ".join(text for text in (said, words) if text)

    def _useful_s(self, entry: Entry) -> float:
        """What there was to track of a pass, since a restart in it: how it was tracked before that nobody knows."""
        first_tai_s = self._tracked.first_tai_s
        if RESUMED not in self._tracked.words or entry.end_tai_s is None or math.isnan(first_tai_s):
            return entry.useful_s
        return min(entry.useful_s, max(0.0, entry.end_tai_s - first_tai_s))

    def _judged_by_path(self, entry: Entry, cause: str) -> tuple[PassState, str]:
        """Of a station that is told of no signal: whether the antenna was where the satellite should be."""
        on_path_s, useful_s = self._tracked.on_path_s, self._useful_s(entry)
        said = f"by program track, on the path for {on_path_s:.0f} of {useful_s:.0f} useful seconds"
        if on_path_s == 0.0:
            return PassState.FAILED, cause or "the antenna never came to the path"
        is_degraded = on_path_s < DEGRADED_SHARE * useful_s
        return PassState.DEGRADED if is_degraded else PassState.DONE, said

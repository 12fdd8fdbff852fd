"""What a restart needs (run.json in the state directory): the pass in progress, its newest fit, what people said of it.

Written whole, beside the loop, at every accepted fit and whenever state, arming, hold or nudge change.  A latch, a
disarm and a stow have files of their own.
"""

import contextlib
import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.control.state import ByHand, ControlState, Nudge
from acu_daemon.control.tracking.by_hand import by_hand_before
from acu_daemon.edge.carry_over_file import from_json, number, reason_of, to_json
from acu_daemon.edge.writer import Latest, Writer, replace_file
from acu_daemon.errors import OrbitError
from acu_daemon.model import FitResult, Model, Pass
from acu_daemon.orbit.timescales import utc_text

VERSION = 1
RUN_STATE = "run.json"
SAME_CLOCK_S = 1.0
RETRY_TICKS = 10  # of a write that failed
_LARGEST_BYTES = 100_000


@dataclass(frozen=True, slots=True)
class RunState:
    """How far a run had come.  clock_s: of a rehearsal, TAI minus CLOCK_MONOTONIC: another start is another one."""

    satellite: str = ""
    rise_tai_s: float = math.inf
    set_tai_s: float = -math.inf
    clock_s: float | None = None
    track: str = ""
    arming: bool | None = None  # as a person left it; None: as configured
    held: bool | None = None  # the daemon held the antenna, with this fault bit; None: it did not
    is_stow_kept: bool = False  # only read: of a version that kept no file `stowed`
    fit: CarryOver | None = None
    by_hand: ByHand = by_hand_before()
    elements: str = ""  # in force then: a nudge is of them alone

    def by_hand_with(self, elements: str) -> ByHand:
        """What of a person's hand holds with the elements that are in force now."""
        return self.by_hand if elements == self.elements else replace(self.by_hand, nudge=None)

    def is_of(self, satellite: str, coming: Pass, clock_s: float | None) -> bool:
        """Whether this is the same pass of the same satellite, and of the same rehearsal."""
        if (clock_s is None) != (self.clock_s is None):
            return False
        is_same_clock = clock_s is None or self.clock_s is None or abs(clock_s - self.clock_s) < SAME_CLOCK_S
        is_same_time = self.rise_tai_s < coming.set_tai_s and coming.rise_tai_s < self.set_tai_s
        return is_same_clock and is_same_time and satellite == self.satellite

    def is_of_another_rehearsal(self, clock_s: float | None) -> bool:
        """Whether both are rehearsals, and not the same one."""
        return clock_s is not None and self.clock_s is not None and abs(clock_s - self.clock_s) >= SAME_CLOCK_S


def read_run_state(directory: Path) -> RunState:
    """Read run.json; the defaults where there is none, or, with an alarm in the log, where it cannot be used.

    One that cannot be used is kept beside it as run.json.bad.
    """
    path = directory / RUN_STATE
    try:
        with path.open("rb") as file:
            return _from_json(json.loads(file.read(_LARGEST_BYTES)))
    except FileNotFoundError:
        return RunState()
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        bad = path.with_name(f"{RUN_STATE}.bad")
        structlog.get_logger("run_state").error(
            "run_state.unreadable",
            file=str(path),
            reason=reason_of(error),
            action=f"begun anew, without arming; kept as {bad.name}",
        )
        with contextlib.suppress(OSError):
            path.replace(bad)
        return RunState()


class RunStateKeeper:
    """Writes run.json.  The loop never waits for the disk, and a write that fails stops no pass: it is tried again."""

    def __init__(
        self, directory: Path, writer: Writer, first: RunState, resume_of: Callable[[FitResult], CarryOver | None]
    ) -> None:
        self._path = directory / RUN_STATE
        self._state = first
        self._resume_of = resume_of
        self._latest: Latest[tuple[RunState, FitResult | None]] = Latest(writer, self._save)
        self._fit: FitResult | None = None
        self._tick_count = 0
        self.problem = ""  # why the newest one is not saved

    def offer(self, fit: FitResult) -> None:
        """Take an accepted fit."""
        self._fit = fit
        self._latest.offer((self._state, fit))

    def see(self, state: ControlState) -> None:
        """Take the memory of a tick; it is written where it differs."""
        held = None if state.foreign_stop.held is None else state.foreign_stop.held.has_interlock_fault
        seen, last = (str(state.tracking.track), state.arming.by_people, held, state.by_hand), self._state
        self._tick_count += 1
        is_retried = bool(self.problem) and self._tick_count % RETRY_TICKS == 0
        if seen != (last.track, last.arming, last.held, last.by_hand) or is_retried:
            track, arming, held, by_hand = seen
            self._state = replace(last, track=track, arming=arming, held=held, by_hand=by_hand)
            self._latest.offer((self._state, self._fit))

    def _save(self, newest: tuple[RunState, FitResult | None]) -> None:
        state, fit = newest
        log: Any = structlog.get_logger("run_state")
        try:
            kept = None if fit is None else self._resume_of(fit)
            text = json.dumps(_to_json(replace(state, fit=kept or state.fit)), allow_nan=False)
            replace_file(self._path, text.encode("ascii"))
        except (OSError, ValueError, OrbitError) as error:
            reason = reason_of(error) if isinstance(error, OSError) else str(error)
            if not self.problem:
                log.error("run_state.not_saved", file=str(self._path), reason=reason)
            self.problem = f"{RUN_STATE}: {reason}"
            return
        if self.problem:
            log.info("run_state.saved_again", file=str(self._path))
            self.problem = ""


def _to_json(state: RunState) -> dict[str, Any]:
    return {
        "version": VERSION,
        "satellite": state.satellite,
        "rise_utc": utc_text(state.rise_tai_s),
        "rise_tai_s": state.rise_tai_s,
        "set_tai_s": state.set_tai_s,
        "clock_s": state.clock_s,
        "state": state.track,
        "arming": state.arming,
        "held": state.held,
        "by_hand": by_hand_json(state.by_hand),
        "elements": state.elements,
        "fit": None if state.fit is None else to_json(state.satellite, state.fit),
    }


def _from_json(read: Any) -> RunState:
    """Raises: ValueError, TypeError, KeyError: what is wrong."""
    if not isinstance(read, dict) or read.get("version") != VERSION:
        raise ValueError(f"expected a JSON object with version {VERSION}")
    clock_s = read["clock_s"]
    satellite = _text(read["satellite"])
    return RunState(
        satellite=satellite,
        rise_tai_s=number(read["rise_tai_s"]),
        set_tai_s=number(read["set_tai_s"]),
        clock_s=None if clock_s is None else number(clock_s),
        track=_text(read["state"]),
        arming=_flag(read, "arming"),
        held=_flag(read, "held"),
        is_stow_kept=bool(_flag(read, "is_stow_kept")),
        fit=None if read["fit"] is None else replace(from_json(read["fit"], satellite), is_of_this_pass=True),
        by_hand=by_hand_of(read.get("by_hand")),
        elements=_text(read.get("elements", "")),
    )


def by_hand_json(by_hand: ByHand) -> dict[str, Any]:
    """What a person changed of a pass, as JSON."""
    nudge, told = by_hand.nudge, None
    if nudge is not None:
        model = None if nudge.model is None else str(nudge.model)
        told = {"along_s": nudge.along_s, "across_deg": nudge.across_deg, "model": model}
    return {"is_held": by_hand.is_held, "nudge": told}


def by_hand_of(read: Any) -> ByHand:
    """The same, read; None: of a version that kept none.  Raises: ValueError, TypeError, KeyError: what is wrong."""
    if read is None:
        return by_hand_before()
    told, nudge = read["nudge"], None
    if told is not None:
        model = None if told["model"] is None else Model(told["model"])
        nudge = Nudge(number(told["along_s"]), number(told["across_deg"]), model)
    return by_hand_before(is_held=bool(_flag(read, "is_held")), nudge=nudge)


def _flag(read: dict[str, Any], name: str) -> bool | None:
    value = read.get(name)
    if not (value is None or isinstance(value, bool)):
        raise ValueError(f"{name} = {value!r}: expected true, false or null")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r}: expected a text")
    return value

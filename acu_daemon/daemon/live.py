"""The live line of a terminal: the verdict, alarms, the pass, where the antenna points; redrawn in place.

It fits the terminal's width.  What does not fit is left out as a whole, the least first; an alarm never is, it goes on
in further lines.  Colours only repeat what words say.
"""

import math
import os
import shutil
import sys
import textwrap
from collections.abc import Mapping
from typing import Protocol

from acu_daemon.control.tracking.state_table import HOLDING, TrackState
from acu_daemon.daemon import words
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import Level, Verdict, alarms, verdict

EVERY_TICKS = 2
VERDICT_WIDTH = 10
GAP = "  "
COLOURS = {Level.GOOD: "32", Level.CALM: "36", Level.WATCH: "33", Level.BAD: "1;31"}  # of ECMA-48


def live_text(seen: Snapshot, beam_error_deg: float | None = None, columns: int | None = None) -> str:
    """What people see of a snapshot: a line, more only where alarms ask for them.

    columns: the width that may be used; None: all there is to say.  A simulation also knows the beam error.
    """
    return "\n".join(_lines(seen, beam_error_deg, columns)[1])


def _lines(seen: Snapshot, beam_error_deg: float | None, columns: int | None) -> tuple[int, list[str]]:
    """How many lines the head takes (verdict, alarms, marks), and all lines."""
    head = GAP.join(part for part in (_word(seen), "; ".join(alarms(seen)), words.marks(seen)) if part)
    lines = [head.rstrip()] if columns is None else textwrap.wrap(head, columns) or [""]
    head_count = len(lines)
    last = lines[-1].ljust(VERDICT_WIDTH) if head_count == 1 else lines[-1]
    room = math.inf if columns is None else columns
    for part in _parts(seen, beam_error_deg, is_short=columns is not None):
        if part == words.pointing(seen) and len(last) + len(GAP) + len(part) > room:
            part = words.pointing(seen, is_short=True)
        if part and len(last) + len(GAP) + len(part) <= room:
            last += GAP + part
    return head_count, [*lines[:-1], last.rstrip()]


def _word(seen: Snapshot) -> str:
    """The verdict, and how long the signal has been missed."""
    said = verdict(seen).word
    is_lost = seen.state in HOLDING and seen.state_s is not None
    return (f"{said} {seen.state_s:.0f} s" if is_lost else said).ljust(VERDICT_WIDTH)


def _parts(seen: Snapshot, beam_error_deg: float | None, *, is_short: bool) -> list[str]:
    """The rest, the most wanted first."""
    error = f"beam error {beam_error_deg:5.3f} deg" if beam_error_deg is not None else ""
    is_blind = seen.state in HOLDING or seen.state == TrackState.SEARCH
    return [
        words.coming(seen, is_short=is_short),
        words.rise(seen),
        words.pointing(seen),
        error,
        words.trust(seen) if is_blind else "",
        words.antenna(seen, 1 if is_short else 2),
        f"{seen.utc[11:19]}Z" if seen.utc else "",
        seen.state,
        f"searched {seen.search}" if seen.search else "",
        words.correction(seen),
        words.trust(seen) if not is_blind else "",
        words.buffer(seen),
        f"rejecting: {seen.rejecting}" if seen.rejecting else "",
    ]


def has_colours(environment: Mapping[str, str]) -> bool:
    """Whether colours are wanted: no-color.org, and a terminal that knows any."""
    return not environment.get("NO_COLOR") and not is_dumb(environment)


def is_dumb(environment: Mapping[str, str]) -> bool:
    """Whether the terminal cannot draw in place."""
    return environment.get("TERM", "") in ("dumb", "unknown")


class Stream(Protocol):
    """What the line is drawn on: standard error, or a queue before it."""

    def write(self, text: str, /) -> object: ...

    def flush(self) -> object: ...


class LiveLine:
    """Draws the line on a terminal; the log clears it before it prints.

    On a terminal that cannot draw in place a line is printed whenever the verdict or an alarm changes.
    """

    def __init__(self, stream: Stream = sys.stderr, environment: Mapping[str, str] = os.environ) -> None:
        self._stream = stream
        self._has_colours = has_colours(environment)
        self._is_dumb = is_dumb(environment)
        self._drawn_count = 0
        self._told: tuple[str, ...] = ()
        self._skip = 0

    def show(self, seen: Snapshot, beam_error_deg: float | None = None) -> None:
        self._skip = (self._skip + 1) % EVERY_TICKS
        if self._skip == 0:
            columns = shutil.get_terminal_size().columns - 1
            head_count, lines = _lines(seen, beam_error_deg, columns)
            if self._is_dumb:
                self._print(seen, lines)
            else:
                self._draw(verdict(seen), head_count, lines)

    def _print(self, seen: Snapshot, lines: list[str]) -> None:
        told = (verdict(seen).word, *alarms(seen))
        if told != self._told:
            self._told = told
            self._stream.write("\n".join(lines) + "\n")
            self._stream.flush()

    def _draw(self, said: Verdict, head_count: int, lines: list[str]) -> None:
        if self._has_colours:
            lines = _coloured(said, head_count, lines)
        self._stream.write(self._erase() + "\n".join(lines))
        self._stream.flush()
        self._drawn_count = len(lines)

    def _erase(self) -> str:
        return "\r\033[K" + "\033[A\033[K" * (self._drawn_count - 1)

    def clear(self) -> None:
        """Take the line away, so that something else can be printed."""
        if self._drawn_count:
            self._stream.write(self._erase())
            self._stream.flush()
            self._drawn_count = 0


def _coloured(said: Verdict, head_count: int, lines: list[str]) -> list[str]:
    """The verdict in its colour; further lines of alarms in the worst; OFF in the worst."""
    size = len(said.word)
    rest = lines[0][size:].replace(" OFF ", f" {_paint('OFF', Level.BAD)} ")
    more = [_paint(line, Level.BAD) for line in lines[1:head_count]]
    return [_paint(lines[0][:size], said.level) + rest, *more, *lines[head_count:]]


def _paint(text: str, level: Level) -> str:
    return f"\033[{COLOURS[level]}m{text}\033[0m"

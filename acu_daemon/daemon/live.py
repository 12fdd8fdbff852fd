"""The live line of a terminal: state, angles, error, correction, buffer; redrawn in place five times a second."""

import shutil
import sys
from typing import Protocol

from acu_daemon.control.states import TrackState
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.model import Model
from acu_daemon.orbit.timescales import utc_text

EVERY_TICKS = 2


def live_text(seen: Snapshot, beam_error_deg: float | None = None) -> str:
    """One line for people; what is not known is shown as a dash.  A simulation also knows the beam error."""
    hands = "" if seen.arming == "armed" else seen.arming.upper()
    mark = " ".join(
        word for word, is_on in (("SIMULATION", seen.is_simulation), ("REHEARSAL", seen.is_rehearsal)) if is_on
    )
    if seen.is_link_up and seen.az_deg is not None and seen.el_deg is not None:
        antenna = f"az {seen.az_deg:7.2f} el {seen.el_deg:6.2f}"
    else:
        antenna = "az       - el      -"
    if beam_error_deg is not None:
        miss = f"beam error {beam_error_deg:5.3f} deg"
    else:
        miss = f"off prediction {seen.miss_deg:5.3f} deg" if seen.miss_deg is not None else "off prediction     - deg"
    if seen.along_s is not None and seen.across_deg is not None:
        side = "late" if seen.along_s >= 0 else "early"
        correction = f"{abs(seen.along_s):5.2f} s {side:5} {seen.across_deg:+6.3f} deg across"
    else:
        correction = "no fit in force"
    parts = [
        f"{utc_text(seen.tai_s, 1)[11:]} {mark}".rstrip(),
        hands,
        f"latched: {seen.latch}" if seen.latch else "",
        f"{seen.state:16} {antenna}",
        f"searched {seen.search}" if seen.state == TrackState.SEARCH else "",
        miss,
        correction,
        _inside(seen),
        f"buffer {seen.buffer_s:3.0f} s {seen.buffer_kind}{' (last pass)' if seen.model == Model.LAST_PASS else ''}",
        f"rejecting: {seen.rejecting}" if seen.rejecting else "",
        seen.encoder_problem,
        seen.turn_alarm,
        seen.limit_alarm,
        seen.clock_alarm,
        f"not written: {seen.files_alarm}" if seen.files_alarm else "",
    ]
    return "  ".join(part for part in parts if part).rstrip()


def _inside(seen: Snapshot) -> str:
    """How long the prediction stays within the half-power beam by its own sigma."""
    if seen.inside_s is None:
        return ""
    sign = ">" if seen.inside_s >= seen.buffer_s - 0.2 else ""
    return f"in beam {sign}{seen.inside_s:.0f} s"


class Stream(Protocol):
    """What the line is drawn on: standard error, or a queue before it."""

    def write(self, text: str, /) -> object: ...

    def flush(self) -> object: ...


class LiveLine:
    """Draws the line on a terminal; the log clears it before it prints."""

    def __init__(self, stream: Stream = sys.stderr) -> None:
        self._stream = stream
        self._is_drawn = False
        self._skip = 0

    def show(self, seen: Snapshot, beam_error_deg: float | None = None) -> None:
        self._skip = (self._skip + 1) % EVERY_TICKS
        if self._skip == 0:
            columns = shutil.get_terminal_size().columns
            self._stream.write("\r\033[K" + live_text(seen, beam_error_deg)[: columns - 1])
            self._stream.flush()
            self._is_drawn = True

    def clear(self) -> None:
        """Take the line away, so that something else can be printed."""
        if self._is_drawn:
            self._stream.write("\r\033[K")
            self._stream.flush()
            self._is_drawn = False

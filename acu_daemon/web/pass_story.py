"""What the strips and the timeline show: a few figures of the last minutes, and the states of the pass.  Pure."""

from collections import deque
from dataclasses import dataclass, field

from acu_daemon.daemon.snapshot import Snapshot

STRIP_EVERY_S = 1.0
STRIP_COUNT = 300
STATE_COUNT = 200
Row = list[float | None]


@dataclass(frozen=True, slots=True)
class Stretch:
    """A state from its beginning on, and whether the signal was there."""

    from_tai_s: float
    state: str
    is_acquired: bool


@dataclass(slots=True)
class PassStory:
    """Owned by the page's feed."""

    strip: deque[Row] = field(default_factory=lambda: deque(maxlen=STRIP_COUNT))
    stretches: deque[Stretch] = field(default_factory=lambda: deque(maxlen=STATE_COUNT))
    version: int = 0
    _pass: str = ""

    def see(self, seen: Snapshot) -> None:
        """Take a snapshot."""
        name = f"{seen.satellite} {seen.rise_utc}" if seen.rise_utc else ""
        if name != self._pass:
            self._pass = name
            self.stretches.clear()
        last = self.stretches[-1] if self.stretches else None
        if last is None or (last.state, last.is_acquired) != (seen.state, seen.is_acquired):
            self.stretches.append(Stretch(round(seen.tai_s, 2), seen.state, seen.is_acquired))
            self.version += 1
        if not self.strip or seen.tai_s - (self.strip[-1][0] or 0.0) >= STRIP_EVERY_S - 0.05:
            self.strip.append(strip_row(seen))


def strip_row(seen: Snapshot) -> Row:
    """Time, error in beamwidths, level, whether acquired, lags, residual: what a strip draws of one instant."""
    beam_deg = 2.0 * seen.half_beam_deg if seen.half_beam_deg else None
    error = seen.off_path_deg / beam_deg if beam_deg and seen.off_path_deg is not None else None
    residual = seen.miss_deg / beam_deg if beam_deg and seen.miss_deg is not None else None
    agc_db = seen.agc_db if seen.is_link_up else None
    row = (seen.tai_s, error, agc_db, float(seen.is_acquired), seen.lag_az_s, seen.lag_el_s, residual)
    return [None if one is None else round(one, 4) for one in row]

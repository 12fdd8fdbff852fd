"""The losses of signal in a pass: when, how long, what was followed, how far from the path.  Pure."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from acu_daemon.report.pass_watch import SeenReading

LEAST_S = 0.25  # one reading without the bit is no loss
HALF_DB = 3.0  # a level that is lower than autotrack's by less: the satellite is within half the beam


@dataclass(frozen=True, slots=True)
class SignalLoss:
    """A time without signal after the first acquisition.

    length_s: until the receiver has a signal again, in any mode or by its level; relock_s: from then until autotrack
    holds it; None: that has not come in the recording.  followed: the states meanwhile with the share of each.
    """

    start_tai_s: float
    length_s: float | None
    relock_s: float | None
    followed: tuple[tuple[str, float], ...]
    largest_off_deg: float | None


def losses_of(readings: Sequence[SeenReading]) -> list[SignalLoss]:
    """All of them; one at the end of the recording has no length."""
    found: list[SignalLoss] = []
    has_signal = _signal_by(readings)
    first = next((k for k, one in enumerate(readings) if one.is_acquired), len(readings))
    k = first
    while k < len(readings):
        if readings[k].is_acquired:
            k += 1
            continue
        again = next((m for m in range(k, len(readings)) if readings[m].is_acquired), len(readings))
        during = readings[k:again]
        if during[-1].tai_s - during[0].tai_s >= LEAST_S:
            found.append(_loss(during, has_signal, readings[again].tai_s if again < len(readings) else None))
        k = again
    return found


def _signal_by(readings: Sequence[SeenReading]) -> Callable[[SeenReading], bool]:
    """Whether a reading has the signal: by its bit, or by a level as it is while autotrack holds it."""
    levels_db = [one.agc_db for one in readings if one.is_acquired and one.agc_db is not None]
    least_db = median(levels_db) - HALF_DB if levels_db else None

    def has_signal(one: SeenReading) -> bool:
        return one.has_signal or (least_db is not None and one.agc_db is not None and one.agc_db >= least_db)

    return has_signal


def _loss(
    during: Sequence[SeenReading], has_signal: Callable[[SeenReading], bool], acquired_tai_s: float | None
) -> SignalLoss:
    start_tai_s = during[0].tai_s
    back = None
    if acquired_tai_s is not None:  # the last time that the signal came, and stayed until it was acquired
        silent = [one.tai_s for one in during if not has_signal(one)]
        back = next((one.tai_s for one in during if not silent or one.tai_s > silent[-1]), acquired_tai_s)
    known = during[1:] or during  # the decision knows of a loss from its first reading on
    states = Counter(one.state for one in known)
    off = [one.off_path_deg for one in during if one.off_path_deg is not None]
    return SignalLoss(
        start_tai_s,
        None if back is None else back - start_tai_s,
        None if back is None or acquired_tai_s is None else acquired_tai_s - back,
        tuple((state, count / len(known)) for state, count in states.most_common()),
        max(off, default=None),
    )

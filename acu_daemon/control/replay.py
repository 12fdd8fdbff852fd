"""Recorded readings through the same fit and prediction as the daemon's (design section 8, `replay`).  Pure."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from acu_daemon.assist.gate import Dwell
from acu_daemon.control.refit import RefitReply, RefitRequest, RefitSetup, Refitter
from acu_daemon.control.states import TrackState
from acu_daemon.model import Reading, Readings

BUFFER_S = 2.0  # as much prediction as a line can need: a refit comes at least once a second of data
REFIT_PERIOD_S = 1.0


@dataclass(frozen=True, slots=True)
class Replayed:
    """What the daemon would have predicted for an instant: encoder frame, azimuth in [0, 360)."""

    az_deg: float
    el_deg: float
    sigma_deg: float | None
    source: TrackState


def replay(
    setup: RefitSetup,
    lines: list[tuple[float, Reading | None]],
    lock_dwell_s: float,
    on_progress: Callable[[int], None] | None = None,
) -> Iterator[Replayed]:
    """Predict every line's instant from the locked readings of earlier lines only; one result a line.

    lines: time, and the reading of that time (None: no angles); times rise.
    Raises: OrbitError: the elements have no answer for a time.
    """
    refitter = Refitter(setup)
    dwell = Dwell(lock_dwell_s)
    waiting: list[Reading] = []
    refitted_tai_s = -np.inf
    current: RefitReply | None = None
    for count, (tai_s, reading) in enumerate(lines):
        is_due = bool(waiting) and waiting[-1].tai_s - refitted_tai_s >= REFIT_PERIOD_S - 1e-6
        is_dry = current is None or tai_s > current.prediction.end_tai_s
        is_loss = bool(waiting) and not (reading is not None and reading.is_locked)
        if is_due or is_dry or is_loss:
            refitted_tai_s = waiting[-1].tai_s if waiting else refitted_tai_s
            current = refitter.refit(_request(waiting, tai_s))
            waiting = []
        yield _line(current, tai_s, is_locked=reading is not None and reading.is_locked)
        if reading is not None and dwell.is_locked(reading):
            waiting.append(reading)
        if on_progress is not None and count % 100 == 0:
            on_progress(count)


def _request(waiting: list[Reading], tai_s: float) -> RefitRequest:
    return RefitRequest(
        readings=Readings(
            np.array([reading.tai_s for reading in waiting]),
            np.array([reading.az_deg for reading in waiting]),
            np.array([reading.el_deg for reading in waiting]),
        ),
        start_tai_s=tai_s,
        horizon_s=BUFFER_S,
        now_tai_s=tai_s,
        near_az_deg=180.0,
    )


def _line(reply: RefitReply | None, tai_s: float, *, is_locked: bool) -> Replayed:
    point = reply.prediction.at(tai_s) if reply else None
    if reply is None or point is None:
        raise ValueError("a line outside the buffer made for it")
    is_fitted = reply.prediction.kind == "FITTED"
    if is_locked:
        source = TrackState.AUTOTRACK_FITTED if is_fitted else TrackState.AUTOTRACK_TLE
    else:
        source = TrackState.HOLD_FITTED if is_fitted else TrackState.HOLD_TLE
    sigma = reply.prediction.sigma_deg
    return Replayed(point.az_deg % 360.0, point.el_deg, None if sigma is None else float(sigma[0]), source)

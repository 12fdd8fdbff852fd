"""Replays recorded readings through the fit and the prediction of the daemon.  Pure."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from acu_daemon.assist.reading_gate import DWELL, Dwell
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup, Refitter
from acu_daemon.model import FitResult, Reading, Readings
from acu_daemon.pointing.plunge import PLUNGED_DEG

BUFFER_S = 2.0  # after its end, and with new readings, a fresh one is made
REFIT_PERIOD_S = 0.5  # at any rate of readings, a refit then comes at least once a second of data, or on every line


@dataclass(frozen=True, slots=True)
class Replayed:
    """What the daemon would have predicted for an instant: encoder frame, azimuth in [0, 360).

    is_fitted: predicted from a fit of this pass.  is_acquired, has_acquired: the signal then, and at any
    time until then.
    left_out: readings that no fit has seen so far, by reason, as of the newest fit.
    """

    az_deg: float
    el_deg: float
    sigma_deg: float | None
    is_fitted: bool
    is_acquired: bool
    has_acquired: bool
    fit: FitResult | None = None  # the newest one then
    left_out: dict[str, int] = field(default_factory=dict)


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
    left_out: dict[str, int] = {}
    has_acquired = is_plunged = False
    for count, (tai_s, reading) in enumerate(lines):
        is_acquired = reading is not None and reading.is_locked
        has_acquired = has_acquired or is_acquired
        is_due = bool(waiting) and waiting[-1].tai_s - refitted_tai_s >= REFIT_PERIOD_S - 1e-6
        is_loss = bool(waiting) and not is_acquired
        if current is None or tai_s > current.prediction.end_tai_s or is_due or is_loss:
            refitted_tai_s = waiting[-1].tai_s if waiting else refitted_tai_s
            current = refitter.refit(_request(waiting, tai_s, is_plunged=is_plunged))
            waiting = []
            left_out = _left_out(current, dwell)
        yield _line(current, tai_s, (is_acquired, has_acquired), left_out)
        if reading is not None and dwell.is_locked(reading):
            waiting.append(reading)
            is_plunged = reading.el_deg > PLUNGED_DEG
        if on_progress is not None and count % 100 == 0:
            on_progress(count)


def _request(waiting: list[Reading], tai_s: float, *, is_plunged: bool) -> RefitRequest:
    return RefitRequest(
        readings=Readings.of(waiting),
        start_tai_s=tai_s,
        horizon_s=BUFFER_S,
        now_tai_s=tai_s,
        near_az_deg=180.0,
        is_plunged=is_plunged,
    )


def _left_out(reply: RefitReply, dwell: Dwell) -> dict[str, int]:
    counts = {DWELL: dwell.rejected_count, **reply.gate.counts}
    return {reason: count for reason, count in counts.items() if count}


def _line(reply: RefitReply, tai_s: float, signal: tuple[bool, bool], left_out: dict[str, int]) -> Replayed:
    prediction = reply.prediction
    point = prediction.at(tai_s)
    if point is None:
        raise ValueError("a line outside the buffer made for it")
    sigma_deg = None
    if prediction.sigma_deg is not None:
        index = min(round((tai_s - prediction.start_tai_s) / prediction.step_s), prediction.sigma_deg.size - 1)
        sigma_deg = float(prediction.sigma_deg[index])
    return Replayed(
        point.az_deg % 360.0, point.el_deg, sigma_deg, prediction.kind == "FITTED", *signal, reply.fit, left_out
    )

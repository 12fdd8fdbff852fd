"""The figures of a pass, from a replay of its recording: everything that its report shows, as JSON.

Angles are degrees, times of day UTC, spans seconds; what is not known is null.  Numbers are rounded here and nowhere
else, so that the page shows what stands in the JSON.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from acu_daemon import __version__
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.tracking.state_table import HOLDING, TrackState
from acu_daemon.daemon.service import PassJob
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.fit_figures import biases, correction, residuals
from acu_daemon.report.json_numbers import MOST_POINTS, rounded, utc_of
from acu_daemon.report.pass_losses import SignalLoss, losses_of
from acu_daemon.report.pass_watch import PassWatch, SeenReading, seconds_where
from acu_daemon.units import DAY_S

FORMAT = 1
WAIT_S = 900.0  # before the rise, in which the antenna sets out
PERIOD_SLACK = 1.5  # of the period: a longer gap between two ticks is one that was left out
QUIET = {"state.changed"}  # events that stand elsewhere in the report


def pass_figures(
    job: PassJob, station: StationFile, satellite: SatelliteFile, watch: PassWatch, *, is_whole: bool
) -> dict[str, Any]:
    """Everything there is to say; of a wait of hours before the pass, the last of them."""
    if job.coming is not None:
        watch = watch.since(job.coming.rise_tai_s - WAIT_S)
    losses = losses_of(watch.readings)
    fit = watch.fits[-1].fit if watch.fits else None
    beam_deg = station.receiver.beamwidth_deg
    return {
        "format": FORMAT,
        "version": __version__,
        "pass": _about(job, satellite, is_whole=is_whole),
        "outcome": _outcome(job, watch, losses, beam_deg),
        "plan": _plan(job, watch),
        "states": _states(watch),
        "losses": [_loss_json(one, beam_deg) for one in losses],
        "residuals": residuals(job, watch, fit),
        "gate": _gate(watch),
        "correction": correction(watch, fit),
        "biases": biases(fit),
        "latency": _latency(watch),
        "ticks": _ticks(job, watch),
        "refused": [{"utc": utc_of(at), "command": what, "why": why} for at, what, why in watch.refused],
        "limited": _limited(watch),
        "line": [_note(at, record) for at, record in watch.notes if record[0] in "LCZ"],
        "hooks": [what for name, what in watch.facts if name == "hook"],
        "schedule": next((what for name, what in watch.facts if name == "schedule"), None),
        "events": _events(watch),
        "curves": _curves(watch, beam_deg),
    }


def _about(job: PassJob, satellite: SatelliteFile, *, is_whole: bool) -> dict[str, Any]:
    site, coming, source = job.refit.site.station, job.coming, job.refit.propagator
    age_s = (coming.rise_tai_s if coming else source.epoch_tai_s) - source.epoch_tai_s
    return {
        "satellite": job.satellite,
        "norad_id": satellite.satellite.norad_id,
        "station": site.name,
        "latitude_deg": site.latitude_deg,
        "longitude_deg": site.longitude_deg,
        "height_m": site.height_m,
        "elements": source.kind,
        "elements_epoch_utc": utc_text(source.epoch_tai_s, 0),
        "elements_age_days": rounded(age_s / DAY_S, 2),
        "estimator": job.refit.estimator,
        "beamwidth_deg": job.control.beamwidth_deg,
        "is_rehearsal": job.is_rehearsal,
        "is_shadow": job.control.is_shadow,
        "is_recording_whole": is_whole,
    }


def _outcome(job: PassJob, watch: PassWatch, losses: Sequence[SignalLoss], beam_deg: float) -> dict[str, Any]:
    acquired = [one.tai_s for one in watch.readings if one.is_acquired]
    visible = [one.tai_s for one in watch.readings if watch.plan is None or one.tai_s >= watch.plan.rise_tai_s]
    held = [one for one in watch.readings if one.state in HOLDING]
    held_off = [one.off_path_deg for one in held if one.off_path_deg is not None]
    share = None
    if visible and acquired:
        share = len([at for at in acquired if at >= visible[0]]) / len(visible)
    largest = max((one.largest_off_deg for one in losses if one.largest_off_deg is not None), default=None)
    relocks = [one.relock_s for one in losses if one.relock_s is not None]
    return {
        "begun_utc": utc_of(watch.ticks_tai_s[0]) if watch.ticks_tai_s else None,
        "ended_utc": utc_of(watch.ticks_tai_s[-1]) if watch.ticks_tai_s else None,
        "first_acquired_utc": utc_of(acquired[0]) if acquired else None,
        "last_acquired_utc": utc_of(acquired[-1]) if acquired else None,
        "acquired_share": rounded(share, 4),
        "loss_count": len(losses),
        "lost_s": rounded(sum(one.length_s or 0.0 for one in losses), 1),
        "lost_at_end_s": rounded(_lost_at_end_s(job, watch, losses), 1),
        "longest_relock_s": rounded(max(relocks, default=None), 2),
        "largest_off_path_in_losses_beamwidths": rounded(_over(largest, beam_deg), 4),
        "largest_off_path_held_deg": rounded(max(held_off, default=None), 4),
        "end_state": watch.states[-1][1] if watch.states else None,
    }


def _lost_at_end_s(job: PassJob, watch: PassWatch, losses: Sequence[SignalLoss]) -> float:
    """How long before the set, or before the end of the recording, the signal was lost for good."""
    if not losses or losses[-1].length_s is not None:
        return 0.0
    end_tai_s = watch.readings[-1].tai_s if job.coming is None else min(watch.readings[-1].tai_s, job.coming.set_tai_s)
    return max(end_tai_s - losses[-1].start_tai_s, 0.0)


def _over(value: float | None, unit: float) -> float | None:
    return None if value is None else value / unit


def _plan(job: PassJob, watch: PassWatch) -> dict[str, Any] | None:
    """What the plan said, and what came."""
    coming, plan = job.coming, watch.plan
    if coming is None:
        return None
    crossing = plan.crossing if plan is not None else None
    seen = [one for one in watch.readings if coming.rise_tai_s <= one.tai_s <= coming.set_tai_s]
    highest = max(seen, key=lambda one: one.el_deg, default=None)
    zenith = [one for one in watch.readings if _is_at_zenith(one)]
    out_s = seconds_where(seen, lambda one: _is_out(one, job.control.beamwidth_deg))
    return {
        "rise_utc": utc_of(coming.rise_tai_s),
        "culmination_utc": utc_of(coming.culmination_tai_s),
        "set_utc": utc_of(coming.set_tai_s),
        "culmination_el_deg": rounded(coming.culmination_el_deg, 2),
        "culmination_az_deg": rounded(coming.culmination_az_deg, 2),
        "came_highest_utc": None if highest is None else utc_of(highest.tai_s),
        "came_highest_el_deg": None if highest is None else rounded(highest.el_deg, 2),
        "start_az_deg": None if plan is None else rounded(plan.start_az_deg, 2),
        "unwinding_count": 0 if plan is None else len(plan.unwindings),
        "zenith_largest_error_deg": None if crossing is None else rounded(crossing.largest_error_deg, 3),
        "zenith_lost_s": None if crossing is None else rounded(crossing.lost_s, 1),
        "came_zenith_s": rounded(seconds_where(watch.readings, _is_at_zenith), 1),
        "came_zenith_largest_off_deg": rounded(
            max((one.off_path_deg for one in zenith if one.off_path_deg is not None), default=None), 3
        ),
        "hidden_s": rounded(sum(end - begin for begin, end in coming.hidden_tai_s), 1),
        "came_out_of_half_beam_s": rounded(out_s, 1),
        "beyond_reach": [str(one) for one in plan.beyond] if plan is not None else [],
    }


def _is_at_zenith(one: SeenReading) -> bool:
    return one.state == TrackState.ZENITH


def _is_out(one: SeenReading, beam_deg: float) -> bool:
    return one.off_path_deg is not None and one.off_path_deg > beam_deg / 2.0


def _states(watch: PassWatch) -> list[dict[str, Any]]:
    end = watch.ticks_tai_s[-1] if watch.ticks_tai_s else 0.0
    zero = watch.readings[0].tai_s if watch.readings else 0.0
    edges = [*watch.states, (end, "")]
    return [
        {"utc": utc_of(at), "t_s": rounded(at - zero, 1), "state": state, "lasted_s": rounded(until - at, 1)}
        for (at, state), (until, _) in pairwise(edges)
    ]


def _loss_json(one: SignalLoss, beam_deg: float) -> dict[str, Any]:
    return {
        "start_utc": utc_of(one.start_tai_s),
        "length_s": rounded(one.length_s, 1),
        "relock_s": rounded(one.relock_s, 2),
        "followed": [{"state": state, "share": rounded(share, 2)} for state, share in one.followed],
        "largest_off_path_beamwidths": rounded(_over(one.largest_off_deg, beam_deg), 4),
    }


def _gate(watch: PassWatch) -> dict[str, Any]:
    area = watch.area
    return {
        "left_out": {} if area is None else dict(sorted(area.rejected_counts.items())),
        "reset_count": 0 if area is None else area.gate.reset_count,
    }


def _latency(watch: PassWatch) -> dict[str, Any]:
    found = np.array([latency for _, latency in watch.latencies_s])
    if not found.size:
        return {"exchange_count": 0, "unanswered_count": watch.unanswered_count}
    p50, p99 = np.percentile(found, [50, 99]).tolist()
    return {
        "exchange_count": int(found.size),
        "unanswered_count": watch.unanswered_count,
        "p50_ms": rounded(1e3 * p50, 2),
        "p99_ms": rounded(1e3 * p99, 2),
        "max_ms": rounded(1e3 * float(found.max()), 2),
    }


def _ticks(job: PassJob, watch: PassWatch) -> dict[str, Any]:
    period_s = job.control.period_s
    gaps = [b - a for a, b in pairwise(watch.ticks_tai_s)]
    late = [gap for gap in gaps if gap > PERIOD_SLACK * period_s]
    return {
        "count": len(watch.ticks_tai_s),
        "left_out_count": round(sum(gap / period_s - 1.0 for gap in late)),
        "longest_gap_s": rounded(max(gaps, default=None), 3),
    }


def _limited(watch: PassWatch) -> dict[str, int]:
    """How often a register write was held to a limit, or refused by the daemon itself."""
    if watch.area is None:
        return {}
    refusals = watch.area.state.refusals
    return {
        "refused_count": refusals.refusal_count,
        "clamped_count": refusals.clamped_count,
        "limited_count": refusals.limited_count,
    }


def _note(at: float, record: Any) -> dict[str, Any]:
    kind = {"L": "line", "C": "clock", "Z": "fit"}[record[0]]
    text = record[-1] or {"line": "open", "clock": "good again", "fit": ""}[kind]
    return {"utc": utc_of(at) if at else None, "what": kind, "text": text}


def _events(watch: PassWatch) -> list[dict[str, Any]]:
    """Warnings, in their order; the same one again is counted."""
    kept: list[dict[str, Any]] = []
    counts: Counter[str] = Counter()
    for at, event in watch.events:
        if event.name in QUIET or not event.is_warning:
            continue
        said = ", ".join(f"{name} {_plain(value)}" for name, value in event.fields.items())
        counts[f"{event.name} {said}"] += 1
        if counts[f"{event.name} {said}"] == 1:
            kept.append({"utc": utc_of(at), "name": event.name, "said": said})
    return [{**one, "count": counts[f"{one['name']} {one['said']}"]} for one in kept]


def _plain(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _curves(watch: PassWatch, beam_deg: float) -> dict[str, Any]:
    """What the pictures are drawn from; t_s counts from zero_utc on."""
    readings = watch.readings
    if not readings:
        return {}
    zero = readings[0].tai_s
    groups = np.array_split(np.arange(len(readings)), min(len(readings), MOST_POINTS))
    worst = [max((readings[k] for k in group), key=lambda one: one.off_path_deg or 0.0) for group in groups]
    latency = watch.latencies_s
    slots = np.array_split(np.arange(len(latency)), min(len(latency), MOST_POINTS)) if latency else []
    slowest = [max((latency[k] for k in slot), key=lambda one: one[1]) for slot in slots]
    return {
        "zero_utc": utc_text(zero, 3),
        "rise_t_s": None if watch.plan is None else rounded(watch.plan.rise_tai_s - zero, 1),
        "set_t_s": None if watch.plan is None else rounded(watch.plan.set_tai_s - zero, 1),
        "path": {
            "t_s": [rounded(one.tai_s - zero, 1) for one in worst],
            "az_deg": [rounded(one.az_deg, 2) for one in worst],
            "el_deg": [rounded(one.el_deg, 2) for one in worst],
            "is_acquired": [int(one.is_acquired) for one in worst],
        },
        "off_path": {
            "t_s": [rounded(one.tai_s - zero, 1) for one in worst],
            "beamwidths": [rounded(_over(one.off_path_deg, beam_deg), 4) for one in worst],
            "sigma_beamwidths": [rounded(_over(one.sigma_deg, beam_deg), 4) for one in worst],
        },
        "level": {
            "t_s": [rounded(one.tai_s - zero, 1) for one in worst],
            "db": [rounded(one.agc_db, 2) for one in worst],
        },
        "correction": {
            "t_s": [rounded(one.tai_s - zero, 1) for one in watch.fits],
            "along_s": [rounded(one.fit.along_s, 4) for one in watch.fits],
            "along_sigma_s": [rounded(one.spread[0], 4) if one.spread else None for one in watch.fits],
            "across_deg": [rounded(one.fit.across_deg, 5) for one in watch.fits],
            "across_sigma_deg": [rounded(one.spread[1], 5) if one.spread else None for one in watch.fits],
        },
        "latency": {
            "t_s": [rounded(at - zero, 1) for at, _ in slowest],
            "ms": [rounded(1e3 * one, 2) for _, one in slowest],
        },
    }

"""The figures of a pass, from a replay of its recording: everything that its report shows, as JSON.

Angles are degrees, times of day UTC, spans seconds; what is not known is null.  Numbers are rounded here and nowhere
else, so that the page shows what stands in the JSON.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np

from acu_daemon import __version__
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.tracking.state_table import HOLDING, TrackState
from acu_daemon.daemon.service import PassJob
from acu_daemon.errors import OrbitError
from acu_daemon.model import FitResult, Readings
from acu_daemon.orbit.look import Look, look_along
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.pass_losses import SignalLoss, losses_of
from acu_daemon.report.pass_watch import PassWatch, SeenReading
from acu_daemon.units import DAY_S, DEG, Array, wrap_180_array

FORMAT = 1
MOST_POINTS = 500  # of a curve
PERIOD_SLACK = 1.5  # of the period: a longer gap between two ticks is one that was left out
BIASES = {  # of the fit's states (assist.estimators.full.estimated_states) that are angles at the encoders
    "az_deg": 6, "az_sec_deg": 7, "el_deg": 8, "el_cot_deg": 9,
    "npae_deg": 13, "an_deg": 14, "aw_deg": 15, "tf_deg": 16,
}  # fmt: skip
QUIET = {"state.changed"}  # events that stand elsewhere in the report


def pass_figures(
    job: PassJob, station: StationFile, satellite: SatelliteFile, watch: PassWatch, *, is_whole: bool
) -> dict[str, Any]:
    """Everything there is to say."""
    losses = losses_of(watch.readings)
    fit = watch.fits[-1].fit if watch.fits else None
    beam_deg = station.receiver.beamwidth_deg
    return {
        "format": FORMAT,
        "version": __version__,
        "pass": _about(job, satellite, is_whole=is_whole),
        "outcome": _outcome(watch, losses, beam_deg),
        "plan": _plan(job, watch),
        "states": _states(watch),
        "losses": [_loss_json(one, beam_deg) for one in losses],
        "residuals": _residuals(job, watch, fit),
        "gate": _gate(watch),
        "correction": _correction(watch, fit),
        "biases": _biases(fit),
        "latency": _latency(watch),
        "ticks": _ticks(job, watch),
        "refused": [{"utc": _utc(at), "command": what, "why": why} for at, what, why in watch.refused],
        "limited": _limited(watch),
        "line": [_note(at, record) for at, record in watch.notes if record[0] in "LCZ"],
        "hooks": [what for name, what in watch.facts if name == "hook"],
        "schedule": next((what for name, what in watch.facts if name == "schedule"), None),
        "events": _events(watch),
        "curves": _curves(watch, beam_deg),
    }


def _utc(tai_s: float) -> str:
    return utc_text(tai_s, 1)


def _r(value: float | None, digits: int) -> float | None:
    return None if value is None or not isfinite(value) else round(float(value), digits) + 0.0


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
        "elements_age_days": _r(age_s / DAY_S, 2),
        "estimator": job.refit.estimator,
        "beamwidth_deg": job.control.beamwidth_deg,
        "is_rehearsal": job.is_rehearsal,
        "is_shadow": job.control.is_shadow,
        "is_recording_whole": is_whole,
    }


def _outcome(watch: PassWatch, losses: Sequence[SignalLoss], beam_deg: float) -> dict[str, Any]:
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
        "begun_utc": _utc(watch.ticks_tai_s[0]) if watch.ticks_tai_s else None,
        "ended_utc": _utc(watch.ticks_tai_s[-1]) if watch.ticks_tai_s else None,
        "first_acquired_utc": _utc(acquired[0]) if acquired else None,
        "last_acquired_utc": _utc(acquired[-1]) if acquired else None,
        "acquired_share": _r(share, 4),
        "loss_count": len(losses),
        "lost_s": _r(sum(one.length_s or 0.0 for one in losses), 1),
        "longest_relock_s": _r(max(relocks, default=None), 2),
        "largest_off_path_in_losses_beamwidths": _r(_over(largest, beam_deg), 4),
        "largest_off_path_held_deg": _r(max(held_off, default=None), 4),
        "end_state": watch.states[-1][1] if watch.states else None,
    }


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
    zenith = [one for one in watch.readings if one.state == TrackState.ZENITH]
    out_s = _seconds([one for one in seen if _is_out(one, job.control.beamwidth_deg)])
    return {
        "rise_utc": _utc(coming.rise_tai_s),
        "culmination_utc": _utc(coming.culmination_tai_s),
        "set_utc": _utc(coming.set_tai_s),
        "culmination_el_deg": _r(coming.culmination_el_deg, 2),
        "culmination_az_deg": _r(coming.culmination_az_deg, 2),
        "came_highest_utc": None if highest is None else _utc(highest.tai_s),
        "came_highest_el_deg": None if highest is None else _r(highest.el_deg, 2),
        "start_az_deg": None if plan is None else _r(plan.start_az_deg, 2),
        "unwinding_count": 0 if plan is None else len(plan.unwindings),
        "zenith_largest_error_deg": None if crossing is None else _r(crossing.largest_error_deg, 3),
        "zenith_lost_s": None if crossing is None else _r(crossing.lost_s, 1),
        "came_zenith_s": _r(_seconds(zenith), 1),
        "came_zenith_largest_off_deg": _r(
            max((one.off_path_deg for one in zenith if one.off_path_deg is not None), default=None), 3
        ),
        "hidden_s": _r(sum(end - begin for begin, end in coming.hidden_tai_s), 1),
        "came_out_of_half_beam_s": _r(out_s, 1),
        "beyond_reach": [str(one) for one in plan.beyond] if plan is not None else [],
    }


def _is_out(one: SeenReading, beam_deg: float) -> bool:
    return one.off_path_deg is not None and one.off_path_deg > beam_deg / 2.0


def _seconds(readings: Sequence[SeenReading]) -> float:
    """How long, of readings a tick apart; a gap counts as one tick."""
    gaps = [min(b.tai_s - a.tai_s, 0.2) for a, b in pairwise(readings)]
    return sum(gaps) + (0.1 if readings else 0.0)


def _states(watch: PassWatch) -> list[dict[str, Any]]:
    end = watch.ticks_tai_s[-1] if watch.ticks_tai_s else 0.0
    zero = watch.readings[0].tai_s if watch.readings else 0.0
    edges = [*watch.states, (end, "")]
    return [
        {"utc": _utc(at), "t_s": _r(at - zero, 1), "state": state, "lasted_s": _r(until - at, 1)}
        for (at, state), (until, _) in pairwise(edges)
    ]


def _loss_json(one: SignalLoss, beam_deg: float) -> dict[str, Any]:
    return {
        "start_utc": _utc(one.start_tai_s),
        "length_s": _r(one.length_s, 1),
        "relock_s": _r(one.relock_s, 2),
        "followed": [{"state": state, "share": _r(share, 2)} for state, share in one.followed],
        "largest_off_path_beamwidths": _r(_over(one.largest_off_deg, beam_deg), 4),
    }


def _residuals(job: PassJob, watch: PassWatch, fit: FitResult | None) -> dict[str, Any]:
    """Fitted readings against the elements as they came, and against the last fit."""
    given = Readings.joined(watch.fitted_readings) if watch.fitted_readings else Readings.of([])
    found: dict[str, Any] = {"reading_count": len(given), "before": None, "after": None}
    if not len(given):
        return found
    source, setup = job.refit.propagator, job.refit
    try:
        zero = watch.readings[0].tai_s
        found["before"] = _residuals_of(given, zero, encoder_look(source, given.tai_s, setup.site, None))
        if fit is not None:
            corrected = source.corrected(fit.correction)
            found["after"] = _residuals_of(
                given, zero, encoder_look(corrected, given.tai_s, setup.site, fit, look_along)
            )
    except OrbitError:
        return found
    return found


def _residuals_of(given: Readings, zero_tai_s: float, look: Look) -> dict[str, Any]:
    across = wrap_180_array(given.az_deg - look.az_deg) * np.cos(np.radians(look.el_deg))
    up = given.el_deg - look.el_deg
    few = _few(given.tai_s.size)
    return {
        "rms_deg": _r(float(np.sqrt(np.mean(across**2 + up**2))), 4),
        "mean_cross_elevation_deg": _r(float(across.mean()), 4),
        "mean_elevation_deg": _r(float(up.mean()), 4),
        "largest_deg": _r(float(np.hypot(across, up).max()), 4),
        "curve": {
            "t_s": _rounded(given.tai_s[few] - zero_tai_s, 1),
            "cross_elevation_deg": _rounded(across[few], 4),
            "elevation_deg": _rounded(up[few], 4),
        },
    }


def _gate(watch: PassWatch) -> dict[str, Any]:
    area = watch.area
    return {
        "left_out": {} if area is None else dict(sorted(area.rejected_counts.items())),
        "reset_count": 0 if area is None else area.gate.reset_count,
    }


def _correction(watch: PassWatch, fit: FitResult | None) -> dict[str, Any] | None:
    if fit is None:
        return None
    spread = watch.fits[-1].spread
    sigma = _sigmas(fit)
    c = fit.correction
    return {
        "fit_count": len(watch.fits),
        "of_utc": _utc(fit.at_tai_s),
        "reading_count": fit.reading_count,
        "rejected_count": fit.rejected_count,
        "residual_rms_deg": _r(fit.residual_rms_deg, 4),
        "along_s": _r(fit.along_s, 3),
        "along_sigma_s": None if spread is None else _r(spread[0], 4),
        "across_deg": _r(fit.across_deg, 4),
        "across_sigma_deg": None if spread is None else _r(spread[1], 4),
        "raan_deg": _r(c.delta_raan_rad / DEG, 5),
        "raan_sigma_deg": _r(_deg(sigma, 0), 5),
        "mean_anomaly_deg": _r(c.delta_mean_anomaly_rad / DEG, 5),
        "mean_anomaly_sigma_deg": _r(_deg(sigma, 1), 5),
        "inclination_deg": _r(c.delta_inclination_rad / DEG, 5),
        "inclination_sigma_deg": _r(_deg(sigma, 5), 5),
        "station_shift_enu_m": [_r(one, 1) for one in fit.station_shift_enu_m],
    }


def _sigmas(fit: FitResult) -> Array | None:
    return None if fit.covariance is None else np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))


def _deg(sigma_rad: Array | None, state: int) -> float | None:
    return None if sigma_rad is None else float(sigma_rad[state]) / DEG


def _biases(fit: FitResult | None) -> list[dict[str, Any]]:
    """Those that the fit may move, each with 1 sigma."""
    if fit is None:
        return []
    sigma = _sigmas(fit)
    found = []
    for name, state in BIASES.items():
        value, of = getattr(fit.bias, name), _deg(sigma, state)
        if value or of:
            found.append({"name": name, "value_deg": _r(value, 4), "sigma_deg": _r(of, 4)})
    return found


def _latency(watch: PassWatch) -> dict[str, Any]:
    found = np.array([latency for _, latency in watch.latencies_s])
    if not found.size:
        return {"exchange_count": 0, "unanswered_count": watch.unanswered_count}
    p50, p99 = np.percentile(found, [50, 99]).tolist()
    return {
        "exchange_count": int(found.size),
        "unanswered_count": watch.unanswered_count,
        "p50_ms": _r(1e3 * p50, 2),
        "p99_ms": _r(1e3 * p99, 2),
        "max_ms": _r(1e3 * float(found.max()), 2),
    }


def _ticks(job: PassJob, watch: PassWatch) -> dict[str, Any]:
    period_s = job.control.period_s
    gaps = [b - a for a, b in pairwise(watch.ticks_tai_s)]
    late = [gap for gap in gaps if gap > PERIOD_SLACK * period_s]
    return {
        "count": len(watch.ticks_tai_s),
        "left_out_count": round(sum(gap / period_s - 1.0 for gap in late)),
        "longest_gap_s": _r(max(gaps, default=None), 3),
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
    return {"utc": _utc(at) if at else None, "what": kind, "text": text}


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
            kept.append({"utc": _utc(at), "name": event.name, "said": said})
    return [{**one, "count": counts[f"{one['name']} {one['said']}"]} for one in kept]


def _plain(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _few(count: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    return np.unique(np.linspace(0, count - 1, min(count, MOST_POINTS)).astype(np.int64))


def _rounded(values: Array, digits: int) -> list[float | None]:
    return [_r(one, digits) for one in values.tolist()]


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
        "rise_t_s": None if watch.plan is None else _r(watch.plan.rise_tai_s - zero, 1),
        "set_t_s": None if watch.plan is None else _r(watch.plan.set_tai_s - zero, 1),
        "path": {
            "t_s": [_r(one.tai_s - zero, 1) for one in worst],
            "az_deg": [_r(one.az_deg, 2) for one in worst],
            "el_deg": [_r(one.el_deg, 2) for one in worst],
            "is_acquired": [int(one.is_acquired) for one in worst],
        },
        "off_path": {
            "t_s": [_r(one.tai_s - zero, 1) for one in worst],
            "beamwidths": [_r(_over(one.off_path_deg, beam_deg), 4) for one in worst],
            "sigma_beamwidths": [_r(_over(one.sigma_deg, beam_deg), 4) for one in worst],
        },
        "level": {
            "t_s": [_r(one.tai_s - zero, 1) for one in worst],
            "db": [_r(one.agc_db, 2) for one in worst],
        },
        "correction": {
            "t_s": [_r(one.tai_s - zero, 1) for one in watch.fits],
            "along_s": [_r(one.fit.along_s, 4) for one in watch.fits],
            "along_sigma_s": [_r(one.spread[0], 4) if one.spread else None for one in watch.fits],
            "across_deg": [_r(one.fit.across_deg, 5) for one in watch.fits],
            "across_sigma_deg": [_r(one.spread[1], 5) if one.spread else None for one in watch.fits],
        },
        "latency": {
            "t_s": [_r(at - zero, 1) for at, _ in slowest],
            "ms": [_r(1e3 * one, 2) for _, one in slowest],
        },
    }

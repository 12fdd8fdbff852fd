"""What the fits of a pass came to, for its report: residuals, correction and biases, each with its sigma."""

from typing import Any

import numpy as np

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.daemon.service import PassJob
from acu_daemon.errors import OrbitError
from acu_daemon.model import FitResult, Readings
from acu_daemon.orbit.look import Look, look_along
from acu_daemon.report.json_numbers import all_rounded, few, rounded, utc_of
from acu_daemon.report.pass_watch import PassWatch
from acu_daemon.units import DEG, Array, wrap_180_array

BIASES = {  # of the fit's states (assist.estimators.full.estimated_states) that are angles at the encoders
    "az_deg": 6, "az_sec_deg": 7, "el_deg": 8, "el_cot_deg": 9,
    "npae_deg": 13, "an_deg": 14, "aw_deg": 15, "tf_deg": 16,
}  # fmt: skip


def residuals(job: PassJob, watch: PassWatch, fit: FitResult | None) -> dict[str, Any]:
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
    some = few(given.tai_s.size)
    return {
        "rms_deg": rounded(float(np.sqrt(np.mean(across**2 + up**2))), 4),
        "mean_cross_elevation_deg": rounded(float(across.mean()), 4),
        "mean_elevation_deg": rounded(float(up.mean()), 4),
        "largest_deg": rounded(float(np.hypot(across, up).max()), 4),
        "curve": {
            "t_s": all_rounded(given.tai_s[some] - zero_tai_s, 1),
            "cross_elevation_deg": all_rounded(across[some], 4),
            "elevation_deg": all_rounded(up[some], 4),
        },
    }


def correction(watch: PassWatch, fit: FitResult | None) -> dict[str, Any] | None:
    """What the last fit says of the orbit, along and across the track and in elements; None: there was none."""
    if fit is None:
        return None
    spread = watch.fits[-1].spread
    sigma = _sigmas(fit)
    c = fit.correction
    return {
        "fit_count": len(watch.fits),
        "of_utc": utc_of(fit.at_tai_s),
        "reading_count": fit.reading_count,
        "rejected_count": fit.rejected_count,
        "residual_rms_deg": rounded(fit.residual_rms_deg, 4),
        "along_s": rounded(fit.along_s, 3),
        "along_sigma_s": None if spread is None else rounded(spread[0], 4),
        "across_deg": rounded(fit.across_deg, 4),
        "across_sigma_deg": None if spread is None else rounded(spread[1], 4),
        "raan_deg": rounded(c.delta_raan_rad / DEG, 5),
        "raan_sigma_deg": rounded(_deg(sigma, 0), 5),
        "mean_anomaly_deg": rounded(c.delta_mean_anomaly_rad / DEG, 5),
        "mean_anomaly_sigma_deg": rounded(_deg(sigma, 1), 5),
        "inclination_deg": rounded(c.delta_inclination_rad / DEG, 5),
        "inclination_sigma_deg": rounded(_deg(sigma, 5), 5),
        "station_shift_enu_m": [rounded(one, 1) for one in fit.station_shift_enu_m],
    }


def _sigmas(fit: FitResult) -> Array | None:
    return None if fit.covariance is None else np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))


def _deg(sigma_rad: Array | None, state: int) -> float | None:
    return None if sigma_rad is None else float(sigma_rad[state]) / DEG


def biases(fit: FitResult | None) -> list[dict[str, Any]]:
    """Those that the fit may move, each with 1 sigma."""
    if fit is None:
        return []
    sigma = _sigmas(fit)
    found = []
    for name, state in BIASES.items():
        value, of = getattr(fit.bias, name), _deg(sigma, state)
        if value or of:
            found.append({"name": name, "value_deg": rounded(value, 4), "sigma_deg": rounded(of, 4)})
    return found

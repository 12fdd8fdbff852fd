"""Element sets of a simulated satellite: SGP4 fitted to its true positions, as a catalogue does it; and their files."""

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from acu_daemon.groundtrack.environment import EPOCH_TAI_S
from acu_daemon.groundtrack.gps import Steering, TrueOrbit
from acu_daemon.model import Correction
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S, DEG, Array

STEPS = np.array([1e-6, 1e-6, 1e-11, 1e-6, 1e-6, 1e-6])
SPAN_S = 3000.0  # half of a revolution on either side of the epoch


def element_set(orbit: TrueOrbit, steering: Steering, time_s: float) -> ElementSet:
    """The set whose SGP4 orbit is nearest to the true one about a time (seconds since the start)."""
    mean = orbit.elements(np.array([time_s]), steering)
    reference = orbit.free.craft.reference
    argp = float(np.arctan2(mean.ey[0], mean.ex[0]))
    first = ElementSet(
        kind="omm",
        name="MADE",
        norad_id=90_001,
        epoch_tai_s=EPOCH_TAI_S + time_s,
        mean_motion_rad_s=reference.alpha_rate_rad_s,
        eccentricity=float(np.hypot(mean.ex[0], mean.ey[0])),
        inclination_rad=float(mean.i_rad[0]),
        raan_rad=float(mean.raan_rad[0]) % (2.0 * np.pi),
        argp_rad=argp % (2.0 * np.pi),
        mean_anomaly_rad=float(mean.alpha_rad[0] - argp) % (2.0 * np.pi),
        bstar_per_radius=0.0,
        file="made",
    )
    times_s = time_s + np.linspace(-SPAN_S, SPAN_S, 25)
    true_m, _ = orbit.states(times_s, steering)
    source, x = Sgp4Propagator(first), np.zeros(6)

    def positions(at: Array) -> Array:
        return source.corrected(Correction(*at.tolist())).states_teme(EPOCH_TAI_S + times_s)[0]

    for _ in range(4):
        here = positions(x)
        partials = [((positions(x + step) - here) / step.sum()).ravel() for step in np.diag(STEPS)]
        x = x + STEPS * np.linalg.lstsq(np.stack(partials, axis=1) * STEPS, (true_m - here).ravel())[0]
    ex = first.eccentricity * np.cos(argp) + x[3]
    ey = first.eccentricity * np.sin(argp) + x[4]
    turned = float(np.arctan2(ey, ex))
    return replace(
        first,
        mean_motion_rad_s=first.mean_motion_rad_s + x[2],
        eccentricity=float(np.hypot(ex, ey)),
        inclination_rad=first.inclination_rad + x[5],
        raan_rad=(first.raan_rad + x[0]) % (2.0 * np.pi),
        argp_rad=turned % (2.0 * np.pi),
        mean_anomaly_rad=(first.argp_rad + first.mean_anomaly_rad + x[1] - turned) % (2.0 * np.pi),
    )


def noisy(one: ElementSet, rng: np.random.Generator) -> ElementSet:
    """With what element sets are wrong by: node 0.0008 deg, 500 m along the track, the mean motion as 5 m of a."""
    return replace(
        one,
        raan_rad=one.raan_rad + rng.normal(0.0, 0.0008 * DEG),
        mean_anomaly_rad=(one.mean_anomaly_rad + rng.normal(0.0, 500.0 / 7.15e6)) % (2.0 * np.pi),
        mean_motion_rad_s=one.mean_motion_rad_s * (1.0 - 1.5 * rng.normal(0.0, 5.0) / 7.15e6),
    )


def omm_text(sets: Sequence[ElementSet]) -> str:
    """A JSON file of OMM records, every digit kept."""
    return json.dumps(
        [
            {
                "OBJECT_NAME": one.name,
                "NORAD_CAT_ID": one.norad_id,
                "EPOCH": utc_text(one.epoch_tai_s, 6).removesuffix("Z"),
                "MEAN_MOTION": one.mean_motion_rad_s * DAY_S / (2.0 * np.pi),
                "ECCENTRICITY": one.eccentricity,
                "INCLINATION": one.inclination_rad / DEG,
                "RA_OF_ASC_NODE": one.raan_rad / DEG,
                "ARG_OF_PERICENTER": one.argp_rad / DEG,
                "MEAN_ANOMALY": one.mean_anomaly_rad / DEG,
                "BSTAR": one.bstar_per_radius,
                "MEAN_ELEMENT_THEORY": "SGP4",
                "REF_FRAME": "TEME",
                "TIME_SYSTEM": "UTC",
                "CENTER_NAME": "EARTH",
                "EPHEMERIS_TYPE": 0,
            }
            for one in sets
        ]
    )

"""Why a satellite is far from its elements: what a fit found, and which causes look like that.  Pure.

A clock that is off, old elements and a manoeuvre all show as the satellite early or late; they differ by how the Earth
has turned meanwhile, 0.46 km beside the track for each second, which the first minutes of a pass do not show: what a
fit then gives to node and anomaly is what its prior says.  So causes are named and none is chosen.
"""

import numpy as np

from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AngleBias, Correction
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DAY_S

BIAS_SIGMAS = 2.0
ALONG_SHARE = 3.0  # so many times more along the track than beside it is along it


def describe_discrepancy(
    source: Propagator,
    settings: EstimatorSettings,
    correction: Correction,
    bias: AngleBias,
    shift: tuple[float, float],
    tai_s: float,
) -> str:
    """Say what the fit found and which causes make that.  shift: seconds late, degrees across, as people are shown."""
    along_s, across_deg = shift
    found = f"{abs(along_s):.1f} s {'late' if along_s >= 0 else 'early'}, {across_deg:+.2f} deg across"
    told = (
        f"the satellite is farther from its elements than their sigmas allow: {found}; they are widened for this pass"
    )
    return "; ".join([told, *_encoders(bias, settings), _causes(source, correction, along_s, tai_s)])


def _encoders(bias: AngleBias, settings: EstimatorSettings) -> list[str]:
    """Encoders that read more beside than they are expected to."""
    return [
        f"the {axis} encoder seems to read {off_deg:+.2f} deg beside (bias_sigma_{axis}_deg = {sigma_deg:g})"
        for axis, off_deg, sigma_deg in (
            ("azimuth", bias.az_deg, settings.bias_sigma_azimuth_deg),
            ("elevation", bias.el_deg, settings.bias_sigma_elevation_deg),
        )
        if abs(off_deg) > BIAS_SIGMAS * sigma_deg
    ]


def _causes(source: Propagator, correction: Correction, along_s: float, tai_s: float) -> str:
    """What looks like this, and where to look; the elements' age is told, for who knows what they are worth."""
    at = np.array([tai_s])
    (r0, v0), (r1, _) = (one.states_teme(at) for one in (source, source.corrected(correction)))
    move_m, along = (r1 - r0)[0], v0[0] / np.linalg.norm(v0[0])
    along_m = float(move_m @ along)
    beside_m = float(np.linalg.norm(move_m - along_m * along))
    days = (tai_s - source.epoch_tai_s) / DAY_S
    age = f"elements ({abs(days):.1f} days {'old' if days >= 0 else 'ahead'})"
    if abs(along_m) > ALONG_SHARE * beside_m:
        clock = f"a clock that is {abs(along_s):.1f} s {'fast' if along_s >= 0 else 'slow'}"
        return (
            f"it looks like {age} that are wrong along the track by age or a manoeuvre, or like {clock}: look at both"
        )
    return (
        f"{beside_m / 1e3:.0f} km of it lie beside the track: it looks like {age} of another object or from before a "
        "manoeuvre, like a station whose place is wrong, or like encoders that read beside: look at all three"
    )

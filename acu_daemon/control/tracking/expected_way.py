"""What the antenna is expected to do over a whole planned pass, and how far its beam will be off.  Pure."""

from dataclasses import dataclass

import numpy as np

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.session.prediction import predict
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.model import Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keyhole import KeyholeRules
from acu_daemon.units import Array

STEP_S, MOST_STEPS = 0.1, 40000


@dataclass(frozen=True, slots=True)
class ExpectedWay:
    """Path and antenna at even steps over what is planned of a pass, degrees, (N,); azimuths continuous.

    off_deg: angle on the sky between them, the drives' lag left out.
    """

    tai_s: Array
    path_az_deg: Array
    path_el_deg: Array
    antenna_az_deg: Array
    antenna_el_deg: Array
    off_deg: Array

    def out_s(self, half_beam_deg: float) -> float:
        """Seconds out of the beam."""
        return float(self.tai_s[1] - self.tai_s[0]) * float((self.off_deg > half_beam_deg).sum())


def expected_way(
    propagator: Propagator, site: Site, plan: PassPlan, envelope: Envelope, keyhole: KeyholeRules
) -> ExpectedWay:
    """Follow a plan from its start to the set: on the path where the axes reach it, past the zenith, to other turns.

    Raises: OrbitError: the propagator has no answer for a time of the pass.
    """
    span_s = plan.set_tai_s - plan.start_tai_s
    step_s = max(STEP_S, span_s / MOST_STEPS)
    buffer = predict(
        *(propagator, site, plan.start_tai_s, plan.start_tai_s, "TLE", plan.start_az_deg),
        horizon_s=span_s,
        step_s=step_s,
        keyhole=keyhole,
        zenith_turn=plan.zenith_turn,
    )
    tai_s: Array = plan.start_tai_s + step_s * np.arange(buffer.az_deg.size, dtype=np.float64)
    turned_deg = np.zeros(tai_s.size)
    for change in plan.unwindings:
        turned_deg += change.by_deg * np.clip((tai_s - change.tai_s) / max(change.for_s, step_s), 0.0, 1.0)
    followed_el = buffer.el_deg if buffer.follow_el_deg is None else buffer.follow_el_deg
    azimuth, elevation = envelope.azimuth, envelope.elevation
    antenna_az = np.clip(buffer.follow_az_deg + turned_deg, azimuth.min_deg, azimuth.max_deg)
    antenna_el = np.clip(followed_el, elevation.min_deg, elevation.max_deg)
    seen = encoder_look(propagator, tai_s, site, None)
    off_deg = _apart_deg(antenna_az, antenna_el, seen.az_deg, seen.el_deg)
    return ExpectedWay(tai_s, buffer.az_deg, buffer.el_deg, antenna_az, antenna_el, off_deg)


def _apart_deg(az1_deg: Array, el1_deg: Array, az2_deg: Array, el2_deg: Array) -> Array:
    el1, el2 = np.radians(el1_deg), np.radians(el2_deg)
    half = np.sin((el2 - el1) / 2) ** 2 + np.cos(el1) * np.cos(el2) * np.sin(np.radians(az2_deg - az1_deg) / 2) ** 2
    apart: Array = np.degrees(2.0 * np.arcsin(np.sqrt(np.clip(half, 0.0, 1.0))))
    return apart

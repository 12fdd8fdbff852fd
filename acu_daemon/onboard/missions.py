"""From what the camera is to see to holds of the body: targets on the ground, and nadir before and after."""

from collections.abc import Sequence

import numpy as np

from acu_daemon.model import EarthOrientation
from acu_daemon.onboard.attitude import Agility, Hold
from acu_daemon.onboard.gimbal_frames import lvlh_from_inertial, roll_pitch_to
from acu_daemon.orbit.frames import teme_from_itrs
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array

_SPARE_S = 0.01  # rounding must not make a slew too short
_BEYOND_S = 1.0


def angles_to(
    propagator: Propagator, target_itrs_m: Array, tai_s: float, orientation: EarthOrientation
) -> tuple[float, float]:
    """Roll and pitch, degrees, that point the body's +Z at a point (3,) of the Earth at one time."""
    at = np.array([tai_s])
    r_m, v_m_s = propagator.states_teme(at)
    to_target = teme_from_itrs(target_itrs_m, at, orientation) - r_m
    return roll_pitch_to((lvlh_from_inertial(r_m, v_m_s) @ to_target[0])[0])


def with_nadir(holds: Sequence[Hold], agility: Agility, start_tai_s: float, end_tai_s: float) -> list[Hold]:
    """The holds with nadir before the first and after the last, as near to them as the slews allow; or nadir alone."""
    if not holds:
        return [Hold(start_tai_s, end_tai_s)]
    before, after = (
        agility.slew_s(max(abs(angle) for angle in hold.angles_deg)) + agility.settle_s + _SPARE_S
        for hold in (holds[0], holds[-1])
    )
    begin, back = holds[0].start_tai_s - before, holds[-1].end_tai_s + after
    return [
        Hold(min(begin, start_tai_s) - _BEYOND_S, begin),
        *holds,
        Hold(back, max(back, end_tai_s) + _BEYOND_S),
    ]

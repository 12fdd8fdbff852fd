"""assist.screening.path_acceleration: an axis that its path speeds up or slows down, to either side, accelerates."""

from dataclasses import replace

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site

from acu_daemon.assist.screening.path_acceleration import is_low_acceleration
from acu_daemon.assist.screening_limits import ACCELERATION_SHARE
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AxisLimits
from acu_daemon.orbit.look import look_at

STEP_S = 0.05
NEAR_SHARE = 0.2  # of the limit: so near to it the two ways to an acceleration may differ
SLOW = EstimatorSettings(azimuth=AxisLimits(-270.0, 270.0, 20.0, 0.1), elevation=AxisLimits(0.0, 90.0, 5.0, 0.01))


@pytest.mark.parametrize("longitude_deg", [0.5, -0.5, 1.0, -1.0])  # east and west of the path: to the right and left
@pytest.mark.parametrize("i_deg", [98.6, 81.4])
def test_a_path_is_low_acceleration_where_the_second_differences_of_its_angles_are_small(
    longitude_deg: float, i_deg: float
) -> None:
    source, where = circular(i_deg), site(longitude_deg)
    tai_s = EPOCH_TAI_S + np.arange(-120.0, 120.0, 0.5)
    before, here, after = (look_at(source, tai_s + dt_s, where) for dt_s in (-STEP_S, 0.0, STEP_S))
    kinds = set()
    for axis in ("azimuth", "elevation"):
        settings = replace(
            SLOW, **{other: AxisLimits(-270.0, 270.0, 90.0, 1e6) for other in {"azimuth", "elevation"} - {axis}}
        )
        name = "az_deg" if axis == "azimuth" else "el_deg"
        ahead, behind = ((getattr(one, name) - getattr(here, name) + 180.0) % 360.0 - 180.0 for one in (after, before))
        acceleration_deg_s2 = (ahead + behind) / STEP_S**2
        limit_deg_s2 = ACCELERATION_SHARE * getattr(SLOW, axis).max_acceleration_deg_s2
        is_clear = np.abs(np.abs(acceleration_deg_s2) / limit_deg_s2 - 1.0) > NEAR_SHARE
        is_low = is_low_acceleration(source, where, None, tai_s, settings)
        assert np.array_equal(is_low[is_clear], (np.abs(acceleration_deg_s2) <= limit_deg_s2)[is_clear]), axis
        kinds |= {(axis, float(sign)) for sign in np.sign(acceleration_deg_s2[is_clear & ~is_low])}
    assert {("azimuth", -1.0), ("azimuth", 1.0), ("elevation", -1.0)} <= kinds

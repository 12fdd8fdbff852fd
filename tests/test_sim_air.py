"""The simulator's air: its rays against an independent integrator, and against the product's model of other air."""

import numpy as np
import pytest
from refraction_figures import integrated_geometric_el_deg

from acu_daemon.model import Station
from acu_daemon.pointing.air import Air, refractivity
from acu_daemon.pointing.refraction import traced
from acu_daemon.sim.shell_air import simulated_air

MARCHED_DEG = 1e-3  # shells against Runge-Kutta; 1e-4 from 1 deg up
EARTH_M = 6371e3


@pytest.mark.parametrize("geometric_el_deg", [0.2, 1.0, 5.0, 30.0])
def test_its_rays_are_those_integrated_another_way(geometric_el_deg: float) -> None:
    def profile_n(up_m: float) -> float:
        wet = 77.6 * 4810.0 * 0.6 * 17.04 / 288.16**2  # 17.04 hPa: saturated at 15 deg C
        dry_top_m = 40136.0 + 148.72 * 15.0
        dry = 77.6 * 1013.0 / 288.16 * max(1.0 - up_m / dry_top_m, 0.0) ** 4
        return dry + wet * max(1.0 - up_m / 11e3, 0.0) ** 4

    apparent = simulated_air(1013.0, 15.0, 60.0).apparent_el_deg(geometric_el_deg, 2e6)
    theirs = integrated_geometric_el_deg(apparent, 2e6, profile_n, EARTH_M)
    assert theirs == pytest.approx(geometric_el_deg, abs=MARCHED_DEG if geometric_el_deg < 1.0 else 1e-4)


@pytest.mark.parametrize(("height_m", "air"), [(0.0, Air(1013.0, 15.0, 60.0)), (3000.0, Air(701.0, -3.0, 50.0))])
def test_it_bends_as_much_as_the_products_model_high_up_and_differently_below(height_m: float, air: Air) -> None:
    theirs = traced(refractivity(air), Station("there", 45.0, 0.0, height_m))
    ours = simulated_air(air.pressure_hpa, air.temperature_c, air.humidity_percent, height_m)
    for el_deg, apart_deg in ((1.0, 0.02), (5.0, 0.002), (10.0, 5e-4), (30.0, 1e-4), (80.0, 1e-5)):
        assert ours.apparent_el_deg(el_deg, 2e6) == pytest.approx(
            float(theirs.apparent_el_deg(el_deg, 2e6)), abs=apart_deg
        )
    assert abs(ours.apparent_el_deg(1.0, 2e6) - float(theirs.apparent_el_deg(1.0, 2e6))) > 0.005


def test_denser_air_bends_more_and_none_not_at_all() -> None:
    plain, denser, none = (simulated_air(1013.0, 15.0, 60.0, denser=factor) for factor in (1.0, 1.1, 0.0))
    bent = plain.apparent_el_deg(10.0, 1.5e6) - 10.0
    assert denser.apparent_el_deg(10.0, 1.5e6) - 10.0 == pytest.approx(1.1 * bent, rel=0.01)
    assert none.apparent_el_deg(10.0, 1.5e6) == pytest.approx(10.0, abs=1e-9)


def test_it_rises_without_a_step_from_below_the_horizon_to_the_zenith() -> None:
    air = simulated_air(1000.0, 25.0, 80.0)
    apparent = np.array([air.apparent_el_deg(el_deg, 1.5e6) for el_deg in np.linspace(-3.0, 90.0, 2001)])
    assert np.diff(apparent).min() > 0.0
    assert apparent[-1] == pytest.approx(90.0, abs=1e-9)

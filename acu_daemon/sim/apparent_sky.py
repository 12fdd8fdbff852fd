"""SIMULATION of the sky as the antenna meets it: through the air, and late by the time that the signal travels."""

from dataclasses import dataclass
from random import Random

from acu_daemon.pointing.air import Air
from acu_daemon.sim.scenario import AirChoice
from acu_daemon.sim.shell_air import SimulatedAir, simulated_air
from acu_daemon.sim.sky import Direction, SimulatedSky

LOWEST_GEOMETRIC_EL_DEG = -1.5  # the densest air lifts what is at -1.2 deg to the horizon
_LIGHT_M_S = 299792458.0


@dataclass(frozen=True, slots=True)
class ApparentSky:
    """Another sky, whose directions are geometric and go on below the horizon, seen through air; None: a vacuum.

    Where the satellite was range / c ago, seen from where the station was then, is where it appears: light time and the
    station's aberration are one, but for the turn of the axes meanwhile, 4e-5 deg.
    """

    sky: SimulatedSky
    air: SimulatedAir | None = None
    is_late: bool = False

    def direction(self, tai_s: float) -> Direction | None:
        """Apparent direction and range; None where the satellite is unknown or below the horizon."""
        seen = self.sky.direction(tai_s)
        if seen is not None and self.is_late:
            seen = self.sky.direction(tai_s - seen[2] / _LIGHT_M_S)
        if seen is None or self.air is None:
            return seen
        az_deg, el_deg, range_m = seen
        apparent_el_deg = self.air.apparent_el_deg(el_deg, range_m)
        return (az_deg, apparent_el_deg, range_m) if apparent_el_deg >= 0.0 else None


def make_air(told: Air, chosen: AirChoice, height_m: float, seed: int) -> SimulatedAir:
    """Air of a scenario over a station; told: the weather where the scenario says nothing of it."""
    drawn = Random(f"{seed} air").uniform(-1.0, 1.0) * chosen.refractivity_drawn_within
    return simulated_air(
        told.pressure_hpa if chosen.pressure_hpa is None else chosen.pressure_hpa,
        told.temperature_c if chosen.temperature_c is None else chosen.temperature_c,
        told.humidity_percent if chosen.humidity_percent is None else chosen.humidity_percent,
        height_m,
        chosen.refractivity_factor * (1.0 + drawn),
        chosen.profile,
    )

"""Tasks of made scenarios for the tests of the satellite's antenna."""

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.gimbal_frames import Gimbal, beam_direction
from acu_daemon.onboard.profile import Task
from acu_daemon.onboard.scenarios import KINDS, OnboardScenario, make_scenario, scenario_task
from acu_daemon.onboard.view import PassView
from acu_daemon.units import Array

__all__ = ["drawn_task", "made_scenario", "made_task"]

FREE = AxisLimits(-1000.0, 1000.0, 100.0, 100.0)


def made_scenario(seed: int, kind: str | None = None) -> OnboardScenario:
    return make_scenario(kind or KINDS[seed % len(KINDS)], np.random.default_rng(seed))


def made_task(seed: int, margin_deg: float, kind: str | None = None, azimuth: AxisLimits | None = None) -> Task:
    return scenario_task(made_scenario(seed, kind), Cone(margin_deg), azimuth)


def drawn_task(
    az_deg: Array, el_deg: Array, cone: Cone, azimuth: AxisLimits = FREE, elevation: AxisLimits = FREE
) -> Task:
    """A pass whose station stands in these directions of the gimbal, samples of 0.05 s: the satellite only turns."""
    to = beam_direction(Gimbal(az_deg, el_deg), np.array([0.0, 0.0, 1.0]))
    side = np.stack([-np.sin(np.radians(az_deg)), np.cos(np.radians(az_deg)), np.zeros(az_deg.size)], axis=1)
    turned = np.stack([-to, side, np.cross(-to, side)], axis=2)
    view = PassView(0.05 * np.arange(az_deg.size), np.tile([7.0e6, 0.0, 0.0], (az_deg.size, 1)), turned)
    return Task(view, np.array([6.4e6, 0.0, 0.0]), cone, azimuth, elevation, np.zeros(az_deg.size, dtype=bool))

"""Tasks of made scenarios for the tests of the satellite's antenna."""

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.profile import Task
from acu_daemon.onboard.scenarios import KINDS, OnboardScenario, make_scenario, scenario_task

__all__ = ["made_scenario", "made_task"]


def made_scenario(seed: int, kind: str | None = None) -> OnboardScenario:
    return make_scenario(kind or KINDS[seed % len(KINDS)], np.random.default_rng(seed))


def made_task(seed: int, margin_deg: float, kind: str | None = None, azimuth: AxisLimits | None = None) -> Task:
    return scenario_task(made_scenario(seed, kind), Cone(margin_deg), azimuth)

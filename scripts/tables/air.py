"""Skies as the antenna meets them: in the simulator's air, whose weather is within 10 % of what the daemon is told."""

from dataclasses import replace

import numpy as np

from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.config.antenna_tables import AtmosphereSection
from acu_daemon.model import Site
from acu_daemon.orbit.look import LIGHT_M_S
from acu_daemon.pointing.air import standard_air
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.sim.apparent_sky import make_air
from acu_daemon.sim.scenario import AirChoice
from tables.skies import Sky

DRAWN = AirChoice(refractivity_drawn_within=0.1)
_TOLD = AtmosphereSection()  # the standard air


def told_air(site: Site) -> Site:
    """The site with the air that the daemon reckons with: the standard air of its place."""
    return replace(site, has_light_time=True, antenna=AntennaModel(refraction=_TOLD.traced(site.station)))


def with_scale(settings: EstimatorSettings, site: Site) -> EstimatorSettings:
    """The settings with the scale of the refraction as a state, as the daemon has it; in a vacuum there is none."""
    if site.antenna is None:
        return settings
    return replace(settings, bias_sigma_elevation_cot_deg=_TOLD.cot_sigma_deg(site.station))


def seen_in_air(sky: Sky, seed: int, chosen: AirChoice = DRAWN) -> Sky:
    """A geometric sky as it appears, late by the way of the signal; its site told of the standard air."""
    station = sky.site.station
    air = make_air(standard_air(station), chosen, station.height_m, seed)
    late_s = sky.range_m / LIGHT_M_S
    az_deg = sky.az_deg - late_s * np.gradient(np.unwrap(sky.az_deg, period=360.0), sky.tai_s)
    el_deg = sky.el_deg - late_s * np.gradient(sky.el_deg, sky.tai_s)
    seen = zip(el_deg.tolist(), sky.range_m.tolist(), strict=True)
    shown_deg = np.array([air.apparent_el_deg(*one) for one in seen])
    return replace(sky, site=told_air(sky.site), az_deg=az_deg % 360.0, el_deg=shown_deg)

"""Readings less what the encoders are known to show beyond the antenna model.  Pure."""

from dataclasses import replace

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import MOUNT_TERMS
from acu_daemon.assist.estimators.full.path_partials import low_shape, sec_el
from acu_daemon.model import AngleBias, Readings, Site
from acu_daemon.pointing.mount import Mount
from acu_daemon.units import Array


def without_bias(readings: Readings, bias: AngleBias, site: Site, range_m: Array) -> Readings:
    """Take a bias (N geometric readings) away, the inverse of what `mount_model.encoder_look` adds, to its square."""
    if bias == AngleBias():
        return readings
    mount = Mount(**{name: getattr(bias, name) for name in MOUNT_TERMS})
    az_deg, el_deg = mount.beam_deg(readings.az_deg, readings.el_deg)
    el = np.radians(el_deg)
    low, _ = low_shape(site, np.sin(el), np.cos(el), range_m)
    az_deg = az_deg - bias.az_deg - bias.az_sec_deg * sec_el(np.cos(el))
    return replace(readings, az_deg=az_deg % 360.0, el_deg=el_deg - bias.el_deg - bias.el_cot_deg * low)

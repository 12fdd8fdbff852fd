"""Element sets of one orbit at one epoch after another, as its own drifts make them."""

from dataclasses import replace

from made_oems import ISS

from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DAY_S

[PLAIN], _ = parse_tle(f"ISS\n{ISS}", "iss.tle")


def later(days: float, than: ElementSet = PLAIN) -> ElementSet:
    """The same orbit later, as SGP4 has it: found by its own drifts of node and perigee."""
    satrec = Sgp4Propagator(than)._satrec
    minutes = days * 1440.0
    return replace(
        than,
        epoch_tai_s=than.epoch_tai_s + days * DAY_S,
        mean_anomaly_rad=(than.mean_anomaly_rad + satrec.mdot * minutes) % 6.283185307179586,
        argp_rad=(than.argp_rad + satrec.argpdot * minutes) % 6.283185307179586,
        raan_rad=(than.raan_rad + satrec.nodedot * minutes) % 6.283185307179586,
    )


NEWER = later(0.25)

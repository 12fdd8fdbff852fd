"""What a pass meets on its way: the sun near the beam, and keep-out zones; told before it.  Pure."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.model import Pass, Site
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sun import sun_direction_deg
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.keep_out import KeepOut, Sun
from acu_daemon.units import DEG, Array

STEP_S, MOST_STEPS = 0.5, 5000  # a low orbit moves by half a degree in one; some ms of work, in the loop
LOWEST_SUN_EL_DEG = -1.0  # one that has set disturbs no pass


@dataclass(frozen=True, slots=True)
class SunOutage:
    """A time in which a satellite is near the sun, and how near it comes."""

    from_tai_s: float
    to_tai_s: float
    least_deg: float
    least_tai_s: float

    @property
    def duration_s(self) -> float:
        return self.to_tai_s - self.from_tai_s

    def __str__(self) -> str:
        return (
            f"{self.least_deg:.1f} deg from the sun at {utc_text(self.least_tai_s, 0)[11:19]}, near it "
            f"{self.duration_s:.0f} s from {utc_text(self.from_tai_s, 0)[11:19]}"
        )


@dataclass(frozen=True, slots=True)
class KeptOut:
    """A time in which a path is in a keep-out zone."""

    name: str
    from_tai_s: float
    to_tai_s: float

    @property
    def duration_s(self) -> float:
        return self.to_tai_s - self.from_tai_s

    def __str__(self) -> str:
        return f"within the keep-out of {self.name} {self.duration_s:.0f} s from {utc_text(self.from_tai_s, 0)[11:19]}"


def sun_outages(propagator: Propagator, site: Site, sun: Sun | None, one: Pass) -> tuple[SunOutage, ...]:
    """When a pass is nearer to the sun's middle than what is kept clear of it; as fine as STEP_S.

    Raises:  OrbitError: the propagator has no answer for a time of the pass.
    """
    if sun is None:
        return ()
    tai_s = _times(one)
    az_deg, el_deg = sun_direction_deg(tai_s, site)
    if site.antenna is not None:
        el_deg = site.antenna.apparent_el_deg(el_deg, np.inf)
    seen = apparent_at(propagator, tai_s, site)
    angle_deg = _angle_deg(az_deg, el_deg, seen.az_deg, seen.el_deg)
    found = []
    for first, after in _spans((angle_deg < sun.radius_deg) & (el_deg > LOWEST_SUN_EL_DEG)):
        least = first + int(np.argmin(angle_deg[first:after]))
        span = float(tai_s[first]), float(tai_s[min(after, tai_s.size - 1)])
        found.append(SunOutage(*span, float(angle_deg[least]), float(tai_s[least])))
    return tuple(found)


def kept_out(propagator: Propagator, site: Site, zones: tuple[KeepOut, ...], one: Pass) -> tuple[KeptOut, ...]:
    """When a pass is within keep-out zones, zone by zone; as fine as STEP_S.

    Raises:  OrbitError: the propagator has no answer for a time of the pass.
    """
    if not zones:
        return ()
    tai_s = _times(one)
    seen = apparent_at(propagator, tai_s, site)
    found = []
    for zone in zones:
        clear_deg = np.vectorize(zone.clearance_deg, otypes=[np.float64])(seen.az_deg, seen.el_deg)
        found += [
            KeptOut(zone.name, float(tai_s[first]), float(tai_s[min(after, tai_s.size - 1)]))
            for first, after in _spans(clear_deg < 0.0)
        ]
    return tuple(sorted(found, key=lambda span: span.from_tai_s))


def _times(one: Pass) -> Array:
    count = 2 + int(min(one.duration_s / STEP_S, MOST_STEPS))
    return np.linspace(one.rise_tai_s, one.set_tai_s, count)


def _angle_deg(az1_deg: Array, el1_deg: Array, az2_deg: Array, el2_deg: Array) -> Array:
    """As model.sky_angle_deg, for many."""
    d_az, d_el = np.sin((az2_deg - az1_deg) * DEG / 2.0), np.sin((el2_deg - el1_deg) * DEG / 2.0)
    h = d_el**2 + np.cos(el1_deg * DEG) * np.cos(el2_deg * DEG) * d_az**2
    angle: Array = 2.0 * np.arcsin(np.sqrt(np.clip(h, 0.0, 1.0))) / DEG
    return angle


def _spans(is_in: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample of each span, and the first after it."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], is_in.astype(np.int8), [0]))))
    return [(int(first), int(after)) for first, after in edges.reshape(-1, 2)]

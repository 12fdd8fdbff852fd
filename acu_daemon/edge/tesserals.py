"""Orbits integrated by brahe (the extra `accuracy`), and what the tesserals do to a phased orbit over its cycle.

brahe's Earth turns about a fixed pole here: precession and nutation move the orbit against the Earth by nothing that a
ground track shows, and computing them at each step takes fifteen times as long.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from acu_daemon.errors import UsageError
from acu_daemon.groundtrack.gps import Ripple, axes_of
from acu_daemon.groundtrack.mean_elements import MeanElements, mean_of, states_of
from acu_daemon.groundtrack.reference import ReferenceOrbit
from acu_daemon.orbit.timescales import gmst_rad, utc_days, utc_text
from acu_daemon.units import Array

RIPPLE_STEP_S = 90.0
_ZONAL = 0


@dataclass(frozen=True, slots=True)
class Forces:
    """Degree and order of the geopotential (EGM2008), and whether Sun and Moon pull."""

    degree: int
    order: int
    has_third_bodies: bool = False


def integrate(forces: Forces, epoch_tai_s: float, state_teme: Array, times_s: Array) -> tuple[Array, Array]:
    """States in TEME at seconds after the epoch, rising: (N, 3) in metres and m/s.  The Earth turns with UT1 = UTC.

    Raises:  UsageError: brahe is not installed.
    """
    brahe = _brahe()
    model = brahe.ForceModelConfig(
        gravity=brahe.GravityConfiguration(degree=forces.degree, order=forces.order, parallel=brahe.ParallelMode.Never),
        third_body=_third_bodies(brahe) if forces.has_third_bodies else None,
        frame_transform=brahe.FrameTransformationModel.EARTH_ROTATION_ONLY,
    )
    epoch = brahe.Epoch(utc_text(epoch_tai_s, 6))
    start = _turned(state_teme[None], -_equinox_rad(np.array([epoch_tai_s])))[0]
    integrator = brahe.NumericalOrbitPropagator(epoch, start, brahe.NumericalPropagationConfig.high_precision(), model)
    states = np.empty((len(times_s), 6))
    for k, time_s in enumerate(times_s):
        integrator.propagate_to(epoch + float(time_s))
        states[k] = integrator.current_state()
    teme = _turned(states, _equinox_rad(epoch_tai_s + times_s))
    return teme[:, :3], teme[:, 3:]


def ripple_of(reference: ReferenceOrbit, start_tai_s: float, node_rad: float, degree: int) -> Ripple:
    """What the tesserals up to degree and order do to the position, over a cycle from the start on.

    The orbit with them less the orbit with the zonals alone; what grows over the cycle is taken out, because it is a
    slightly other mean orbit: a parabola along the track, a line of the node and of the eccentricity vector.
    """
    times_s = np.arange(0.0, reference.cycle.days * reference.nodal_day_s, RIPPLE_STEP_S)
    start = MeanElements(
        *(np.array([one]) for one in (reference.a_m, 0.0, reference.e, reference.i_rad, node_rad, 0.0))
    )
    state = np.hstack(states_of(start))[0]
    with_them = integrate(Forces(degree, degree), start_tai_s, state, times_s)
    without = integrate(Forces(degree, _ZONAL), start_tai_s, state, times_s)
    base = mean_of(*without)
    moved = with_them[0] - without[0]
    seen = np.stack([np.sum(moved * axis, axis=1) for axis in axes_of(base)], axis=1)
    return Ripple(RIPPLE_STEP_S, seen - _slow(seen, times_s / times_s[-1], base.alpha_rad))


def _slow(seen_m: Array, share: Array, u: Array) -> Array:
    """The part of radial, along, across (N, 3) that slowly changing elements make, by least squares."""
    one, c, s = np.ones_like(share), np.cos(u), np.sin(u)
    zero = np.zeros_like(share)
    columns = []
    for growth in (one, share):
        columns += [(growth, zero, zero), (-c * growth, 2.0 * s * growth, zero), (-s * growth, -2.0 * c * growth, zero)]
        columns += [(zero, zero, s * growth), (zero, zero, c * growth)]
    columns += [(zero, growth, zero) for growth in (one, share, share**2, share**3)]
    design = np.stack([np.stack(column, axis=1).ravel() for column in columns], axis=1)
    solved = np.linalg.lstsq(design, seen_m.ravel())[0]
    slow: Array = (design @ solved).reshape(seen_m.shape)
    return slow


def _brahe() -> Any:
    try:
        brahe: Any = import_module("brahe")
    except ImportError:
        raise UsageError("the tesserals need brahe: pip install 'acu-daemon[accuracy]'") from None
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    return brahe


def _third_bodies(brahe: Any) -> list[Any]:
    low = brahe.EphemerisSource.LowPrecision
    return [brahe.ThirdBodyConfiguration(body, low) for body in (brahe.ThirdBody.SUN, brahe.ThirdBody.MOON)]


def _equinox_rad(tai_s: Array) -> Array:
    """From the origin that brahe's Earth turns from to TEME's equinox: sidereal time less rotation angle (IAU 2000)."""
    day, fraction = utc_days(tai_s)
    ut1_days = (day - 2451545.0) + fraction
    rotation_rad = 2.0 * np.pi * ((ut1_days % 1.0) + 0.7790572732640 + 0.00273781191135448 * ut1_days)
    turn: Array = np.remainder(gmst_rad(tai_s, 0.0) - rotation_rad + np.pi, 2.0 * np.pi) - np.pi
    return turn


def _turned(states: Array, angle_rad: Array) -> Array:
    """States (N, 6) turned about the pole, so that right ascensions grow by the angle."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    turned = states.copy()
    for x, y in ((0, 1), (3, 4)):
        turned[:, x] = c * states[:, x] - s * states[:, y]
        turned[:, y] = s * states[:, x] + c * states[:, y]
    return turned

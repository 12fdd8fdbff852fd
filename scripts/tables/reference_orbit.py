"""The reference orbits of the papers, integrated numerically by brahe: nothing of our own Brouwer code is in them.

Geopotential EGM2008 to degree 6 and order 4 (zonal to 6, tesseral to 4), drag with the Harris-Priester density.
brahe is asked for every sample of a 10 s table (`propagate_to`); between the samples positions and velocities
are joined by a cubic, which for a low orbit is right to a millimetre.
"""

from dataclasses import dataclass
from math import radians

import numpy as np

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction
from acu_daemon.orbit.kepler import OsculatingElements, state_from_elements
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import Array

ZONAL_DEGREE, TESSERAL_ORDER = 6, 4
DRAG_AREA_M2, DRAG_COEFFICIENT, MASS_KG = 1.0, 2.2, 115.0  # a box like the data collection satellites
TABLE_STEP_S = 10.0


@dataclass(frozen=True, slots=True)
class OrbitAtEpoch:
    """Osculating elements, true equator and mean equinox of date."""

    epoch_utc: str
    a_km: float
    e: float
    i_deg: float
    raan_deg: float
    argp_deg: float
    mean_anomaly_deg: float

    def state_teme(self) -> tuple[Array, Array]:
        """Position in metres and velocity in m/s, each (3,)."""
        angles = (self.i_deg, self.raan_deg, self.argp_deg, self.mean_anomaly_deg)
        values = (self.a_km * 1e3, self.e, *(radians(angle) for angle in angles))
        r_m, v_m_s = state_from_elements(OsculatingElements(*(np.array([value]) for value in values)))
        return r_m[0], v_m_s[0]


class TabulatedOrbit:
    """An orbit known at even steps, as a `Propagator`: cubic between the steps.  Immutable and picklable."""

    kind = "table"

    def __init__(self, epoch_tai_s: float, step_s: float, r_teme_m: Array, v_teme_m_s: Array) -> None:
        self.epoch_tai_s = epoch_tai_s
        self._step_s, self._r_m, self._v_m_s = step_s, r_teme_m, v_teme_m_s

    @property
    def end_tai_s(self) -> float:
        return self.epoch_tai_s + self._step_s * (len(self._r_m) - 1)

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        """Positions and velocities (N, 3), m and m/s, TEME.  Raises OrbitError outside the table."""
        x = (tai_s - self.epoch_tai_s) / self._step_s
        if np.any((x < 0.0) | (x > len(self._r_m) - 1)):
            raise OrbitError("the reference orbit is not tabulated at one of the times")
        i = np.minimum(x.astype(int), len(self._r_m) - 2)
        u, h = (x - i)[:, None], self._step_s
        y0, y1, d0, d1 = self._r_m[i], self._r_m[i + 1], self._v_m_s[i] * h, self._v_m_s[i + 1] * h
        a, b = 2.0 * (y0 - y1) + d0 + d1, 3.0 * (y1 - y0) - 2.0 * d0 - d1
        return ((a * u + b) * u + d0) * u + y0, ((3.0 * a * u + 2.0 * b) * u + d0) / h

    def corrected(self, correction: Correction) -> Propagator:
        """Not for a truth.  Raises OrbitError unless the correction is none."""
        if correction != Correction():
            raise OrbitError("the reference orbit is the truth: it takes no correction")
        return self


def integrate(orbit: OrbitAtEpoch, span_s: float, step_s: float = TABLE_STEP_S) -> TabulatedOrbit:
    """Integrate an orbit over a span from its epoch on."""
    return integrate_state(orbit.epoch_utc, np.concatenate(orbit.state_teme()), span_s, step_s)


def integrate_state(epoch_utc: str, state_teme: Array, span_s: float, step_s: float = TABLE_STEP_S) -> TabulatedOrbit:
    """Integrate a state, (6,) in m and m/s, over a span from its epoch on.

    Earth orientation is left out (UT1 = UTC, no polar motion), as it is for the estimators.
    """
    import brahe

    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())
    epoch_tai_s = tai_from_utc(epoch_utc)
    epoch = brahe.Epoch(epoch_utc)
    itrf = brahe.state_teme_to_itrf(epoch, state_teme)
    value = brahe.ParameterSource.value
    forces = brahe.ForceModelConfig(
        gravity=brahe.GravityConfiguration.spherical_harmonic(ZONAL_DEGREE, TESSERAL_ORDER),
        drag=brahe.DragConfiguration(
            brahe.AtmosphericModel.HARRIS_PRIESTER, value(DRAG_AREA_M2), value(DRAG_COEFFICIENT)
        ),
        mass=value(MASS_KG),
    )
    integrator = brahe.NumericalOrbitPropagator(
        epoch,
        brahe.state_itrf_to_gcrf(epoch, itrf),
        brahe.NumericalPropagationConfig.high_precision(),
        forces,
    )
    count = int(span_s / step_s) + 2
    states = np.empty((count, 6))
    epochs = [epoch + k * step_s for k in range(count)]
    for k, when in enumerate(epochs):
        integrator.propagate_to(when)
        states[k] = integrator.current_state()
    teme = brahe.state_itrf_to_teme(epochs, brahe.state_gcrf_to_itrf(epochs, states))
    return TabulatedOrbit(epoch_tai_s, step_s, teme[:, :3].copy(), teme[:, 3:].copy())

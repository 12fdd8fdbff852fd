"""What every source of orbits can do."""

from collections.abc import Sequence
from math import inf
from typing import Protocol, runtime_checkable

import numpy as np

from acu_daemon.model import Correction
from acu_daemon.units import Array

EPHEMERIDES = ("oem", "cpf", "sp3")


class Propagator(Protocol):
    """A satellite's motion.  Immutable and picklable (it is sent to the process that fits)."""

    def __hash__(self) -> int:
        """Equal sources share what is remembered of them."""

    @property
    def kind(self) -> str:
        """The source: "brouwer", "tle", "omm" and so on."""

    @property
    def epoch_tai_s(self) -> float:
        """Epoch of the elements."""

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        """Positions (N, 3) in metres and velocities (N, 3) in m/s at the times (N,).

        Frame:   true equator, mean equinox of date (TEME).
        Raises:  OrbitError: no answer for one of the times (decayed); the message names satellite, time and reason.
        """

    def corrected(self, correction: Correction) -> "Propagator":
        """The same source with a correction of its mean elements at epoch.

        The correction is absolute: it replaces one given before, and `Correction()` gives the source itself.
        """


@runtime_checkable
class Bounded(Protocol):
    """A source that has answers only within spans of time, such as an ephemeris."""

    @property
    def spans_tai_s(self) -> tuple[tuple[float, float], ...]:
        """Start and end of every span, in order, ends included, without overlap."""


@runtime_checkable
class Together(Protocol):
    """A source that knows a faster way to the states of several corrections than one after the other."""

    def states_together(self, corrections: Sequence[Correction], tai_s: Array) -> tuple[Array, Array]:
        """Positions and velocities (M, N, 3) as corrected by each of the M, in the units and frame of `states_teme`.

        Raises:  OrbitError: as `corrected` and `states_teme` do.
        """


def states_together(source: Propagator, corrections: Sequence[Correction], tai_s: Array) -> tuple[Array, Array]:
    """Positions and velocities (M, N, 3) of a source as corrected by each of the M corrections, like `states_teme`.

    Raises:  OrbitError: no answer for one of the times, or no orbit with one of the corrections.
    """
    if isinstance(source, Together):
        return source.states_together(corrections, tai_s)
    each = [source.corrected(one).states_teme(tai_s) for one in corrections]
    return np.array([r_m for r_m, _ in each]), np.array([v_m_s for _, v_m_s in each])


def is_ephemeris(propagator: Propagator) -> bool:
    """Whether a source says itself for when it holds, and has states in place of elements."""
    return propagator.kind in EPHEMERIDES


def spans_tai_s(propagator: Propagator) -> tuple[tuple[float, float], ...]:
    """When a source has answers: its spans, or for most sources always."""
    return propagator.spans_tai_s if isinstance(propagator, Bounded) else ((-inf, inf),)

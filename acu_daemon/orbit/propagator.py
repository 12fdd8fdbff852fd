"""What every source of orbits can do."""

from math import inf
from typing import Protocol, runtime_checkable

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


def is_ephemeris(propagator: Propagator) -> bool:
    """Whether a source says itself for when it holds, and has states in place of elements."""
    return propagator.kind in EPHEMERIDES


def spans_tai_s(propagator: Propagator) -> tuple[tuple[float, float], ...]:
    """When a source has answers: its spans, or for most sources always."""
    return propagator.spans_tai_s if isinstance(propagator, Bounded) else ((-inf, inf),)

"""A source of orbits as JSON and back, bit for bit: elements, or every state of an ephemeris."""

from dataclasses import asdict, fields, replace
from typing import Any

import numpy as np

from acu_daemon.errors import ElementsError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.ephemeris import Ephemeris, EphemerisPropagator
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sgp4_source import Sgp4Propagator

_ARRAYS = ("tai_s", "r_m", "v_m_s")


def orbit_json(source: Propagator) -> dict[str, Any]:
    """ElementsError: a kind of source that is not known here."""
    if isinstance(source, Sgp4Propagator):
        return {"sgp4": asdict(replace(source.elements, file=""))}
    if isinstance(source, BrouwerPropagator):
        return {"brouwer": asdict(source.elements), "short_period": source.short_period}
    if isinstance(source, EphemerisPropagator):
        return {"ephemeris": [_segment_json(one) for one in source.ephemeris.segments]}
    raise ElementsError(f"an orbit of kind {source.kind!r} cannot be recorded")


def orbit_of(read: dict[str, Any], orientation: EarthOrientation) -> Propagator:
    """orientation: the station's, with which the states were turned.

    Raises: ValueError, TypeError, KeyError: what is wrong.
    """
    if "sgp4" in read:
        return Sgp4Propagator(ElementSet(**read["sgp4"]))
    if "brouwer" in read:
        return BrouwerPropagator(BrouwerElements(**read["brouwer"]), read["short_period"])
    return EphemerisPropagator(Ephemeris([_segment_of(one) for one in read["ephemeris"]], orientation))


def _segment_json(segment: EphemerisSegment) -> dict[str, Any]:
    said = {one.name: getattr(segment, one.name) for one in fields(segment)}
    return {**said, "file": "", **{name: said[name].tolist() for name in _ARRAYS}}


def _segment_of(read: dict[str, Any]) -> EphemerisSegment:
    arrays = {name: np.array(read[name]) for name in _ARRAYS}
    return EphemerisSegment(**{**read, **arrays, "notes": tuple(read["notes"])})

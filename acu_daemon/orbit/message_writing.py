"""Orbit messages of a fitted orbit, OMM and OEM (CCSDS 502.0-B-3, KVN).  Pure.

The orbit is this station's own, so the originator is, and a comment says what it was fitted to: it must not pass for
the catalogue's.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.ccsds_text import comments, field, joined, time_text
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DAY_S, DEG, Array

INTERPOLATION_DEGREE = 7  # Hermite through four states
REV_DAY = DAY_S / (2.0 * np.pi)
UNKNOWN_ID = "UNKNOWN"


@dataclass(frozen=True, slots=True)
class Sender:
    """Who says it and when; remarks: what people should know of it."""

    originator: str
    created_tai_s: float
    remarks: tuple[str, ...] = ()


def omm_text(elements: ElementSet, sender: Sender, object_id: str = UNKNOWN_ID) -> str:
    """An orbit mean-elements message, with all that SGP4 readers ask for."""
    return joined(
        (
            field("CCSDS_OMM_VERS", "2.0"),
            *_header(sender),
            field("OBJECT_NAME", elements.name or elements.label),
            field("OBJECT_ID", object_id),
            field("CENTER_NAME", "EARTH"),
            field("REF_FRAME", "TEME"),
            field("TIME_SYSTEM", "UTC"),
            field("MEAN_ELEMENT_THEORY", "SGP4"),
            field("EPOCH", time_text(elements.epoch_tai_s)),
            field("MEAN_MOTION", f"{elements.mean_motion_rad_s * REV_DAY:.12f}"),
            field("ECCENTRICITY", f"{elements.eccentricity:.12f}"),
            field("INCLINATION", f"{elements.inclination_rad / DEG:.10f}"),
            field("RA_OF_ASC_NODE", f"{elements.raan_rad / DEG:.10f}"),
            field("ARG_OF_PERICENTER", f"{elements.argp_rad / DEG:.10f}"),
            field("MEAN_ANOMALY", f"{elements.mean_anomaly_rad / DEG:.10f}"),
            field("EPHEMERIS_TYPE", "0"),
            field("CLASSIFICATION_TYPE", "U"),
            field("NORAD_CAT_ID", str(elements.norad_id)),
            field("ELEMENT_SET_NO", "999"),
            field("REV_AT_EPOCH", "0"),
            field("BSTAR", f"{elements.bstar_per_radius:.12g}"),
            field("MEAN_MOTION_DOT", "0.0"),
            field("MEAN_MOTION_DDOT", "0.0"),
        )
    )


def oem_text(
    name: str,
    object_id: str,
    source: Propagator,
    tai_s: Array,
    orientation: EarthOrientation,
    sender: Sender,
    useable_tai_s: tuple[float, float],
) -> str:
    """An orbit ephemeris message, Earth-fixed.

    useable_tai_s: what is within the padding that interpolation needs.  Raises: OrbitError: no state at one of the
    times.
    """
    r_m, v_m_s = itrs_from_teme(*source.states_teme(tai_s), tai_s, orientation)
    return joined(
        (
            field("CCSDS_OEM_VERS", "2.0"),
            *_header(sender),
            "META_START",
            field("OBJECT_NAME", name),
            field("OBJECT_ID", object_id),
            field("CENTER_NAME", "EARTH"),
            field("REF_FRAME", "ITRF2014"),
            field("TIME_SYSTEM", "UTC"),
            field("START_TIME", time_text(float(tai_s[0]))),
            field("USEABLE_START_TIME", time_text(useable_tai_s[0])),
            field("USEABLE_STOP_TIME", time_text(useable_tai_s[1])),
            field("STOP_TIME", time_text(float(tai_s[-1]))),
            field("INTERPOLATION", "HERMITE"),
            field("INTERPOLATION_DEGREE", str(INTERPOLATION_DEGREE)),
            "META_STOP",
            *_states(tai_s, r_m, v_m_s),
        )
    )


def _header(sender: Sender) -> Sequence[str]:
    return (
        *comments(sender.remarks),
        field("CREATION_DATE", time_text(sender.created_tai_s, 3)),
        field("ORIGINATOR", sender.originator),
    )


def _states(tai_s: Array, r_m: Array, v_m_s: Array) -> Iterator[str]:
    for at, r, v in zip(tai_s.tolist(), r_m / 1e3, v_m_s / 1e3, strict=True):
        numbers = [*(f"{one:.6f}" for one in r.tolist()), *(f"{one:.9f}" for one in v.tolist())]
        yield f"{time_text(at)} {' '.join(numbers)}"

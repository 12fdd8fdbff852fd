"""Ephemeris messages made for tests, KVN and XML, from any source of states."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.ephemeris import Ephemeris, EphemerisPropagator
from acu_daemon.orbit.oem import parse_oem
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import Array

ISS = """1 25544U 98067A   22041.55493323  .00006763  00000-0  12771-3 0  9996
2 25544  51.6412 243.7057 0005670 116.5714 333.9560 15.49692082325546
"""
META = {
    "OBJECT_NAME": "ISS",
    "OBJECT_ID": "1998-067-A",
    "CENTER_NAME": "Earth",
    "REF_FRAME": "TEME",
    "TIME_SYSTEM": "UTC",
}
START = tai_from_utc("2022-02-11T20:00:00Z")
NO_ORIENTATION = EarthOrientation()
States = tuple[Array, Array, Array]  # times (N,), positions (N, 3) in metres, velocities (N, 3) in m/s


def iss() -> Sgp4Propagator:
    """An orbit like that of the ISS, its epoch at START."""
    [elements], [] = parse_tle(ISS, "iss.tle")
    return Sgp4Propagator(replace(elements, epoch_tai_s=START))


def states(span_s: float = 7200.0, step_s: float = 60.0, start_tai_s: float = START) -> States:
    """States of the ISS by SGP4, TEME."""
    tai_s = start_tai_s + np.arange(0.0, span_s + 1.0, step_s)
    return tai_s, *iss().states_teme(tai_s)


def _meta(tai_s: Array, changes: Mapping[str, str]) -> dict[str, str]:
    first, last = (utc_text(float(t), 6).removesuffix("Z") for t in (tai_s[0], tai_s[-1]))
    return {**META, "START_TIME": first, "STOP_TIME": last, **changes}


def _rows(of: States) -> list[list[str]]:
    tai_s, r_m, v_m_s = of
    rows = zip(tai_s.tolist(), (r_m / 1e3).tolist(), (v_m_s / 1e3).tolist(), strict=True)
    return [[utc_text(t, 6).removesuffix("Z"), *(f"{x:.9f}" for x in (*r, *v))] for t, r, v in rows]


def kvn(*segments: States, **changes: str) -> str:
    """A message with a segment for each; changes: other META values, empty ones left out."""
    lines = ["CCSDS_OEM_VERS = 2.0", "COMMENT a = b", "CREATION_DATE = 2022-02-11T00:00:00", "ORIGINATOR = TEST", ""]
    for of in segments:
        lines += ["META_START", "COMMENT of the segment"]
        lines += [f"{key:<20} = {value}" for key, value in _meta(of[0], changes).items() if value]
        lines += ["META_STOP", "", "COMMENT states"]
        lines += ["  ".join(row) for row in _rows(of)]
        lines += ["", "COVARIANCE_START", f"EPOCH = {_rows(of)[0][0]}", "COV_REF_FRAME = RTN", "1.0e-6"]
        lines += ["0.0 1.0e-6", "0.0 0.0 1.0e-6", "COVARIANCE_STOP", ""]
    return "\n".join(lines) + "\n"


def xml(*segments: States, **changes: str) -> str:
    """The same as XML, with units and accelerations."""
    keys = ("EPOCH", "X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
    units = ("", *3 * (' units="km"',), *3 * (' units="km/s"',))
    lines = ["<?xml version='1.0' encoding='UTF-8'?>", "<oem id='CCSDS_OEM_VERS' version='2.0'>"]
    lines += ["<header><COMMENT>EPOCH</COMMENT><ORIGINATOR>TEST</ORIGINATOR></header>", "<body>"]
    for of in segments:
        meta = "".join(f"<{key}>{value}</{key}>" for key, value in _meta(of[0], changes).items() if value)
        lines += ["<segment>", f"<metadata><COMMENT>c</COMMENT>{meta}</metadata>", "<data>", "<COMMENT>d</COMMENT>"]
        for row in _rows(of):
            leaves = (f"<{key}{unit}>{value}</{key}>" for key, unit, value in zip(keys, units, row, strict=True))
            lines.append(f"<stateVector>{''.join(leaves)}<X_DDOT>0.0</X_DDOT></stateVector>")
        lines.append("<covarianceMatrix><EPOCH>2022-02-11T20:00:00</EPOCH><CX_X>1.0</CX_X></covarianceMatrix>")
        lines += ["</data>", "</segment>"]
    return "\n".join([*lines, "</body>", "</oem>"]) + "\n"


def source(text: str, orientation: EarthOrientation = NO_ORIENTATION) -> EphemerisPropagator:
    """A propagator of a message that must be good."""
    segments, problems = parse_oem(text, "x.oem")
    assert problems == []
    return EphemerisPropagator(Ephemeris(segments, orientation))

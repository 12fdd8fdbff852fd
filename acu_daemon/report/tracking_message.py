"""The angles of a pass as a CCSDS tracking data message (TDM, 503.0-B-2, KVN).  Pure.

Angles are the direction in which the antenna pointed, by its encoders less what a survey of the mount says; refraction
is left in, and the weather given, as the standard asks of who makes one.  A segment ends where the signal is lost or
acquired: its quality is one.
"""

from collections.abc import Iterator, Sequence

from acu_daemon.orbit.ccsds_text import comments, field, joined, time_text
from acu_daemon.orbit.message_writing import Sender
from acu_daemon.pointing.air import ZERO_CELSIUS_K, Air
from acu_daemon.pointing.mount import Mount
from acu_daemon.report.pass_watch import SeenReading

LONGEST_GAP_S = 5.0  # the line was lost: another segment
QUALITY = {True: "VALIDATED", False: "DEGRADED"}
FULL_TURN_DEG = 360.0
DIGITS = 5


def tdm_text(
    readings: Sequence[SeenReading],
    station: str,
    satellite: str,
    mount: Mount,
    air: Air | None,
    sender: Sender,
    *,
    has_signal: bool = True,
) -> str:
    """The message; "" where autotrack never had the satellite.

    air: the weather, None: nobody knows.  has_signal: whether anybody tells of one; else all is raw.
    """
    lines: list[str] = [
        field("CCSDS_TDM_VERS", "2.0"),
        *comments(sender.remarks),
        field("CREATION_DATE", time_text(sender.created_tai_s, 3)),
        field("ORIGINATOR", sender.originator),
    ]
    segments = list(_segments(_tracked(readings, has_signal=has_signal)))
    for segment in segments:
        lines += _segment(segment, station, satellite, mount, air, has_signal=has_signal)
    return joined(lines) if segments else ""


def _tracked(readings: Sequence[SeenReading], *, has_signal: bool) -> list[SeenReading]:
    """From the first to the last acquired one; one of each microsecond."""
    acquired = [k for k, one in enumerate(readings) if one.is_acquired or not has_signal]
    kept: list[SeenReading] = []
    for one in readings[acquired[0] : acquired[-1] + 1] if acquired else []:
        if not kept or round(one.tai_s * 1e6) > round(kept[-1].tai_s * 1e6):
            kept.append(one)
    return kept


def _segments(readings: Sequence[SeenReading]) -> Iterator[list[SeenReading]]:
    segment: list[SeenReading] = []
    for one in readings:
        if segment and (
            one.is_acquired is not segment[-1].is_acquired or one.tai_s - segment[-1].tai_s > LONGEST_GAP_S
        ):
            yield segment
            segment = []
        segment.append(one)
    if segment:
        yield segment


def _segment(
    readings: Sequence[SeenReading], station: str, satellite: str, mount: Mount, air: Air | None, *, has_signal: bool
) -> Iterator[str]:
    quality = QUALITY[readings[0].is_acquired] if has_signal else "RAW"
    yield "META_START"
    if quality == "DEGRADED":
        yield from comments(["no signal: the antenna followed the prediction, or searched"])
    yield field("TIME_SYSTEM", "UTC")
    yield field("START_TIME", time_text(readings[0].tai_s))
    yield field("STOP_TIME", time_text(readings[-1].tai_s))
    yield field("PARTICIPANT_1", station)
    yield field("PARTICIPANT_2", satellite)
    yield field("MODE", "SEQUENTIAL")
    yield field("PATH", "2,1")
    yield field("TIMETAG_REF", "RECEIVE")
    yield field("ANGLE_TYPE", "AZEL")
    yield field("DATA_QUALITY", quality)
    yield "META_STOP"
    yield "DATA_START"
    for keyword, value in _weather(air):
        yield f"{keyword} = {time_text(readings[0].tai_s)} {value}"
    for one in readings:
        az_deg, el_deg = (float(angle) for angle in mount.beam_deg(one.az_deg, one.el_deg))
        when = time_text(one.tai_s)
        yield f"ANGLE_1 = {when} {round(az_deg, DIGITS) % FULL_TURN_DEG:.{DIGITS}f}"
        yield f"ANGLE_2 = {when} {el_deg:.{DIGITS}f}"
    yield "DATA_STOP"


def _weather(air: Air | None) -> Iterator[tuple[str, str]]:
    if air is not None:
        yield "PRESSURE", f"{air.pressure_hpa:.2f}"
        yield "RHUMIDITY", f"{air.humidity_percent:.1f}"
        yield "TEMPERATURE", f"{air.temperature_c + ZERO_CELSIUS_K:.2f}"

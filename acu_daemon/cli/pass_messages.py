"""CCSDS messages of a pass, made with its report: TDM of the angles, OMM or OEM of the fitted orbit."""

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from acu_daemon.cli.tape_head import TapedPass
from acu_daemon.edge.kept_tapes import safe_name
from acu_daemon.edge.writer import replace_file
from acu_daemon.errors import OrbitError, UsageError
from acu_daemon.model import FitResult
from acu_daemon.orbit.message_writing import Sender, oem_text, omm_text
from acu_daemon.orbit.moved_epoch import at_epoch
from acu_daemon.orbit.propagator import Propagator, spans_tai_s
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.pass_watch import PassWatch
from acu_daemon.report.tracking_message import tdm_text
from acu_daemon.units import MU_M3_S2

PAD_S = 600.0  # before and after what is useable: interpolation looks beyond
AHEAD_S = 43200.0  # an ephemeris is good for the next passes
STEPS_PER_TURN = 180
SHORTEST_STEP_S, LONGEST_STEP_S = 10.0, 300.0


@dataclass(frozen=True, slots=True)
class Message:
    """A message, and the ending of its file's name.  is_orbit: the next station may track by it."""

    ending: str
    text: str
    is_orbit: bool


def messages_of(taped: TapedPass, watch: PassWatch) -> list[Message]:
    """Those that there is something to say in.  OrbitError: the fitted orbit has no states where they are asked for."""
    if not watch.ticks_tai_s:
        return []
    found = [Message("tdm", tdm, is_orbit=False)] if (tdm := _tdm(taped, watch)) else []
    fit = watch.fits[-1].fit if watch.fits else None
    return found if fit is None else [*found, _orbit(taped, watch, fit)]


def _sender(taped: TapedPass, watch: PassWatch, *remarks: str) -> Sender:
    station = taped.target.station
    rehearsal = ("REHEARSAL: nothing of this was in the sky",) if taped.job.is_rehearsal else ()
    return Sender(station.recording.originator, watch.ticks_tai_s[-1], (*rehearsal, *remarks))


def _tdm(taped: TapedPass, watch: PassWatch) -> str:
    station = taped.target.station
    site, mount = station.site.station, station.mount.mount()
    place = f"{site.latitude_deg:.6f} deg north, {site.longitude_deg:.6f} deg east, {site.height_m:.1f} m (WGS84)"
    remarks = [
        f"angles of the antenna {site.name}, {place}",
        "refraction is left in; surveyed mount terms are taken out",
    ]
    if watch.fits:
        bias = watch.fits[-1].fit.bias
        remarks.append(
            f"zero points fitted, and left in: azimuth {bias.az_deg:.4f} deg, elevation {bias.el_deg:.4f} deg"
        )
    air = station.atmosphere.air(site) if station.atmosphere.refraction else None
    return tdm_text(
        watch.readings,
        site.name,
        taped.job.satellite,
        mount,
        air,
        _sender(taped, watch, *remarks),
        has_signal=taped.job.control.has_signal,
    )


def _orbit(taped: TapedPass, watch: PassWatch, fit: FitResult) -> Message:
    source, satellite = taped.job.refit.propagator, taped.target.satellite.satellite
    corrected = source.corrected(fit.correction)
    what = (
        f"fitted by {taped.job.station} to {fit.reading_count} angles up to {utc_text(fit.at_tai_s, 0)}, rms "
        f"{fit.residual_rms_deg:.4f} deg; from {source.kind} of {utc_text(source.epoch_tai_s, 0)}; not the catalogue's"
    )
    if isinstance(corrected, Sgp4Propagator):
        elements, off_m = at_epoch(corrected, fit.at_tai_s)
        sender = _sender(taped, watch, what, f"epoch moved to the pass, {off_m:.1f} m off the fit within a revolution")
        return Message("omm", omm_text(elements, sender), is_orbit=True)
    first, last = _useable(taped, corrected)
    step_s = _step_s(corrected, first)
    start, end = _span(corrected, first)
    times = np.arange(max(first - PAD_S, start), min(last + PAD_S, end) + 1e-6, step_s)
    name = str(satellite.norad_id) if satellite.norad_id is not None else satellite.name
    orientation = taped.job.refit.site.orientation
    useable = (max(first, float(times[0])), min(last, float(times[-1])))
    text = oem_text(satellite.name, name, corrected, times, orientation, _sender(taped, watch, what), useable)
    return Message("oem", text, is_orbit=True)


def _useable(taped: TapedPass, source: Propagator) -> tuple[float, float]:
    coming = taped.job.coming
    first = taped.begun_tai_s if coming is None else coming.rise_tai_s
    last = first if coming is None else coming.set_tai_s
    return first, min(last + AHEAD_S, _span(source, first)[1])


def _span(source: Propagator, tai_s: float) -> tuple[float, float]:
    return next(((a, b) for a, b in spans_tai_s(source) if a <= tai_s <= b), (tai_s, tai_s))


def _step_s(source: Propagator, tai_s: float) -> float:
    """A share of the revolution."""
    r_m, v_m_s = source.states_teme(np.array([tai_s]))
    a_m = 1.0 / (2.0 / float(np.linalg.norm(r_m)) - float(np.sum(v_m_s**2)) / MU_M3_S2)
    turn_s = 2.0 * pi * (a_m**3 / MU_M3_S2) ** 0.5
    return min(max(float(round(turn_s / STEPS_PER_TURN)), SHORTEST_STEP_S), LONGEST_STEP_S)


def write_messages(taped: TapedPass, watch: PassWatch, folder: Path, name: str, config: Path | None) -> list[Path]:
    """Write them beside the report; a copy of the orbit for the next station, where one is named.

    UsageError: they cannot be written, or the orbit cannot be made; says why.
    """
    try:
        found = messages_of(taped, watch)
    except OrbitError as error:
        raise UsageError(f"{name}: no message of the orbit: {error}") from None
    written = []
    send_to = taped.target.station.recording.send_to
    for message in found:
        paths = [folder / f"{name}.{message.ending}"]
        if message.is_orbit and send_to is not None and not taped.job.is_rehearsal:
            paths.append((config or Path()) / send_to / f"{safe_name(taped.job.satellite)}.{message.ending}")
        for path in paths:
            try:
                replace_file(path, message.text.encode("ascii"))
            except OSError as error:
                raise UsageError(f"{path}: cannot be written: {error.strerror}") from None
            written.append(path)
    return written

"""What `acu-daemon status` prints for people: some lines, the verdict first, alarms next.  Pure."""

from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon import words
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms, verdict

SUN_NEAR_DEG = 20.0  # farther it is not worth a row
OLD_S = 1.0  # a reading older than this is not where the antenna is


def status_lines(seen: Snapshot) -> list[str]:
    """Lines for a terminal; a figure that is not known is left out, or said to be unknown."""
    lines = [headline(seen)]
    if mark := words.marks(seen):
        lines.append(mark)
    lines += [f"ALARM       {text}" for text in alarms(seen)]
    return [*lines, *(f"{name:11} {text}" for name, text in status_rows(seen))]


def headline(seen: Snapshot) -> str:
    """The verdict, since when, and why."""
    said = verdict(seen)
    since = f" for {words.clock_text(seen.state_s)}" if seen.state_s is not None else ""
    return f"{said.word}{since}: {said.why}"


def status_rows(seen: Snapshot) -> list[tuple[str, str]]:
    """Name and text of each row, the most wanted first; rows without anything to say are left out."""
    rows = (
        ("time", seen.utc),
        ("satellite", ", over ".join(text for text in (seen.satellite, seen.station) if text)),
        ("pass", _pass(seen)),
        ("zenith", seen.zenith),
        ("foreseen", seen.phantom),
        ("wind", seen.wind.removeprefix("wind ")),
        ("paused", f"no pass is begun until {seen.paused_until_utc}" if seen.paused_until_utc else ""),
        ("tilt", seen.tilt),
        ("elements", "; ".join(text for text in (seen.elements, seen.elements_problem) if text)),
        ("steers", steering(seen)),
        ("antenna", _antenna(seen)),
        ("command", _command(seen)),
        ("path", _path(seen)),
        ("nudge", words.nudge(seen)),
        ("signal", _signal(seen)),
        ("prediction", _prediction(seen)),
        ("buffer", _buffer(seen)),
        ("sun", _sun(seen)),
        ("control", _control(seen)),
        ("next", "; ".join(seen.next_passes)),
        ("ACU", ", ".join(text for text in (seen.acu, seen.acu_mode if seen.is_link_up else "no link") if text)),
        ("late ticks", f"{seen.skipped_tick_count} of {seen.tick_count + seen.skipped_tick_count} skipped"),
    )
    return [(name, text) for name, text in rows if text]


S = TrackState
_STEERS = {
    S.IDLE: "nobody",
    S.PREPOSITION: "the daemon, to where the pass begins; then autotrack",
    S.ACQUIRE_TLE: "the daemon, by the elements; autotrack takes over with the signal",
    S.AUTOTRACK_TLE: "the ACU's autotrack; the elements would take over",
    S.AUTOTRACK_FITTED: "the ACU's autotrack; this pass's fit would take over",
    S.PROGRAM: "the daemon, along the predicted path, with or without a signal",
    S.HOLD_FITTED: "the daemon, by this pass's fit; autotrack takes over with the signal",
    S.HOLD_TLE: "the daemon, by the elements; autotrack takes over with the signal",
    S.SEARCH: "the daemon, around the path; autotrack takes over with the signal",
    S.ZENITH: "the daemon, past the zenith; then autotrack",
    S.FALSE_LOCK: "the daemon, back from a false lock onto the path; then autotrack",
    S.AVOID: "the daemon, clear of a keep-out; then autotrack",
    S.SLAVED: "another program, by the write lease; then the daemon",
    S.MANUAL: "the local panel",
    S.STOW: "the ACU, to or in its stow position",
    S.FAULT: "nobody",
    S.LINK_LOST: "not known: no link",
}


def steering(seen: Snapshot) -> str:
    """What steers the antenna and what would take over."""
    return f"{_STEERS[TrackState(seen.state)]} ({seen.state})"


def _pass(seen: Snapshot) -> str:
    when = words.coming(seen).removeprefix(seen.satellite).strip()
    at = words.rise(seen) or (f"at {seen.set_utc[11:]}" if "sets in" in when else "")
    return f"{when} {at}".strip()


def _sun(seen: Snapshot) -> str:
    """How far it is from the beam, and of an antenna that stands how long until its keep-out is there."""
    if seen.sun_deg is None:
        return ""
    if seen.sun_reach_s is None:
        return f"{seen.sun_deg:.1f} deg from the beam" if seen.sun_deg < SUN_NEAR_DEG else ""
    when = (
        f"its keep-out is here in {words.clock_text(seen.sun_reach_s)}" if seen.sun_reach_s else "within its keep-out"
    )
    out = ""
    if seen.way_out_az_deg is not None and seen.way_out_el_deg is not None:
        out = f", clear of it is az {seen.way_out_az_deg:.1f} el {seen.way_out_el_deg:.1f}"
    return f"{seen.sun_deg:.1f} deg from the beam, {when}{out}"


def _antenna(seen: Snapshot) -> str:
    if seen.az_deg is None or seen.el_deg is None or seen.reading_age_s is None:
        return "not known: no reading yet"
    where = f"az {seen.az_deg:.2f} el {seen.el_deg:.2f} deg, measured {seen.reading_age_s:.1f} s ago"
    if not seen.is_link_up or seen.reading_age_s > OLD_S:
        return f"was at {where}; where it is now is not known"
    return where + (f", moving {seen.speed_deg_s:.2f} deg/s" if seen.speed_deg_s is not None else "")


def _command(seen: Snapshot) -> str:
    """What was last written into the command registers."""
    if seen.command_az_deg is None or seen.command_el_deg is None:
        return ""
    return f"az {seen.command_az_deg:.2f} el {seen.command_el_deg:.2f} deg, last written, azimuth over all turns"


def _buffer(seen: Snapshot) -> str:
    return f"{words.buffer(seen).removeprefix('buffer').strip()} ahead" if seen.buffer_kind else ""


def _path(seen: Snapshot) -> str:
    """Where the antenna points beside the path."""
    if seen.off_path_deg is None or seen.half_beam_deg is None:
        return ""
    if seen.state == TrackState.PREPOSITION and not seen.is_on_path:
        return f"{seen.off_path_deg:.1f} deg to go, measured"
    side = "ON" if seen.is_on_path else "OFF"
    return (
        f"{side} the path of the {seen.path}: {seen.off_path_deg:.3f} deg beside it, measured "
        f"(half-power beam: {seen.half_beam_deg:g} deg)"
    )


def _signal(seen: Snapshot) -> str:
    if not seen.is_link_up:
        return "not known: no link"
    agc = f", AGC {seen.agc_db:.1f} dB" if seen.agc_db is not None else ""
    if not seen.is_told_of_signal:
        return "nobody tells of it"
    age = f" {seen.signal_age_s:.1f} s ago" if seen.signal_age_s is not None else ""
    level = f" {seen.signal_db:.1f} dB" if seen.signal_db is not None else ""
    lost = f" for {seen.signal_lost_s:.0f} s" if seen.signal_lost_s is not None else ""
    is_by_receiver = seen.state == TrackState.PROGRAM and seen.is_acquired
    who = f"a receiver{'' if level else age}" if is_by_receiver else "the ACU"
    beside = f", receiver{level or ' heard'}{age}" if age and (level or not is_by_receiver) else ""
    return f"{f'acquired, by {who}' if seen.is_acquired else f'not acquired{lost}'}{agc}{beside}"


def _prediction(seen: Snapshot) -> str:
    if not seen.buffer_kind:
        return ""
    sigma = f", 1 sigma {seen.sigma_deg:.3f} deg" if seen.sigma_deg is not None else ""
    age = f", fit {seen.fit_age_s:.0f} s old" if seen.fit_age_s is not None else ""
    return f"{words.trust(seen).removeprefix('prediction ')}{sigma}; {' '.join(words.correction(seen).split())}{age}"


def _control(seen: Snapshot) -> str:
    writes = f"{seen.write_count} writes"
    if seen.clamped_count or seen.refusal_count or seen.limited_count:
        writes += f" ({seen.clamped_count} slowed, {seen.limited_count} held at a limit, {seen.refusal_count} refused)"
    return f"{seen.arming}, {seen.state}, {writes}"

"""What `acu-daemon status` prints for people: some lines, the verdict first, alarms next.  Pure."""

from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon import words
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms, verdict

OLD_S = 1.0  # a reading older than this is not where the antenna is


def status_lines(seen: Snapshot) -> list[str]:
    """Lines for a terminal; a figure that is not known is left out, or said to be unknown."""
    said = verdict(seen)
    since = f" for {words.clock_text(seen.state_s)}" if seen.state_s is not None else ""
    lines = [f"{said.word}{since}: {said.why}"]
    if mark := words.marks(seen):
        lines.append(mark)
    lines += [f"ALARM       {text}" for text in alarms(seen)]
    rows = (
        ("time", seen.utc),
        ("satellite", f"{seen.satellite}, over {seen.station}" if seen.station else seen.satellite),
        ("pass", _pass(seen)),
        ("elements", "; ".join(text for text in (seen.elements, seen.elements_problem) if text)),
        ("antenna", _antenna(seen)),
        ("path", _path(seen)),
        ("signal", _signal(seen)),
        ("prediction", _prediction(seen)),
        ("control", _control(seen)),
        ("ACU", ", ".join(text for text in (seen.acu, seen.acu_mode if seen.is_link_up else "no link") if text)),
        ("late ticks", f"{seen.skipped_tick_count} of {seen.tick_count + seen.skipped_tick_count} skipped"),
    )
    return [*lines, *(f"{name:11} {text}" for name, text in rows if text)]


def _pass(seen: Snapshot) -> str:
    when = words.coming(seen).removeprefix(seen.satellite).strip()
    at = words.rise(seen) or (f"at {seen.set_utc[11:]}" if "sets in" in when else "")
    return f"{when} {at}".strip()


def _antenna(seen: Snapshot) -> str:
    if seen.az_deg is None or seen.el_deg is None or seen.reading_age_s is None:
        return "not known: no reading yet"
    where = f"az {seen.az_deg:.2f} el {seen.el_deg:.2f} deg, measured {seen.reading_age_s:.1f} s ago"
    if not seen.is_link_up or seen.reading_age_s > OLD_S:
        return f"was at {where}; where it is now is not known"
    return where + (f", moving {seen.speed_deg_s:.2f} deg/s" if seen.speed_deg_s is not None else "")


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
    return f"{'acquired, by the ACU' if seen.is_acquired else 'not acquired'}{agc}"


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

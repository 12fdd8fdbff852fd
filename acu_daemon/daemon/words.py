"""The phrases of live line, status and service line, from a snapshot.  Pure; what is not known is an empty phrase."""

from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.model import Model
from acu_daemon.units import DAY_S

SHORT_NAME = 14


def marks(seen: Snapshot) -> str:
    """What must stand on everything that people read of a simulation."""
    return " ".join(
        word for word, is_on in (("SIMULATION", seen.is_simulation), ("REHEARSAL", seen.is_rehearsal)) if is_on
    )


def clock_text(seconds: float) -> str:
    """Minutes and seconds, with hours where there are any."""
    minutes, second = divmod(max(0, round(seconds)), 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours}:{minute:02d}:{second:02d}" if hours else f"{minute}:{second:02d}"


def coming(seen: Snapshot, *, is_short: bool = False) -> str:
    """Which satellite, and when it rises or sets."""
    name = seen.satellite
    if is_short and len(name) > SHORT_NAME:
        name = f"{name[: SHORT_NAME - 1]}~"
    if seen.rise_in_s is None or seen.set_in_s is None:
        return name
    if seen.rise_in_s > 0.0:
        when = f"rises in {clock_text(seen.rise_in_s)}"
    elif seen.set_in_s > DAY_S:
        when = "up for more than a day"
    else:
        when = f"sets in {clock_text(seen.set_in_s)}" if seen.set_in_s > 0.0 else "has set"
    return f"{name} {when}".strip()


def rise(seen: Snapshot) -> str:
    """The pass that is waited for."""
    if seen.rise_in_s is None or seen.set_in_s is None or seen.culmination_deg is None or seen.rise_in_s <= 0.0:
        return ""
    lasts_s = seen.set_in_s - seen.rise_in_s
    lasts = f"for {lasts_s / 60:.0f} min" if lasts_s < DAY_S else "for more than a day"
    return f"at {seen.rise_utc[11:]} up to {seen.culmination_deg:.0f} deg {lasts}"


def pointing(seen: Snapshot, *, is_short: bool = False) -> str:
    """Where it points beside the path: ON within the half-power beam, else OFF; in short without the source."""
    if seen.off_path_deg is None:
        return ""
    if seen.state == TrackState.PREPOSITION:
        return f"{seen.off_path_deg:.1f} deg to go"
    by = "" if is_short or seen.path == "fit" else f" of {seen.path.replace(' to the signal', '')}"
    return f"{'ON' if seen.is_on_path else 'OFF'} path{by} {seen.off_path_deg:4.2f} deg"


def trust(seen: Snapshot) -> str:
    """How long the prediction stays within the half-power beam by its own sigma: of the prediction, not the antenna."""
    if not seen.buffer_kind:
        return ""
    if seen.inside_s is None:
        return "prediction without a sigma"
    if seen.inside_s <= 0.0:
        return "prediction not sure"
    sign = ">" if seen.inside_s >= seen.buffer_s - 0.2 else ""
    return f"prediction good for {sign}{seen.inside_s:.0f} s"


def antenna(seen: Snapshot, digits: int = 2) -> str:
    """The measured angles, while they are measured."""
    if seen.is_link_up and seen.az_deg is not None and seen.el_deg is not None:
        return f"az {seen.az_deg:{4 + digits}.{digits}f} el {seen.el_deg:{3 + digits}.{digits}f}"
    return f"az {'-':>{4 + digits}} el {'-':>{3 + digits}}"


def correction(seen: Snapshot) -> str:
    """What the fit adds to the elements."""
    if seen.along_s is None or seen.across_deg is None:
        return "no fit in force"
    side = "late" if seen.along_s >= 0 else "early"
    return f"{abs(seen.along_s):5.2f} s {side:5} {seen.across_deg:+6.3f} deg across"


def buffer(seen: Snapshot) -> str:
    """How long the registers can be fed, and from what."""
    last = " (last pass)" if seen.model == Model.LAST_PASS else ""
    return f"buffer {seen.buffer_s:3.0f} s {seen.buffer_kind}{last}".rstrip()


def nudge(seen: Snapshot) -> str:
    """What a person moves the path by; empty: by nothing."""
    along_s, across_deg = seen.nudge_along_s, seen.nudge_across_deg
    if along_s == 0.0 and across_deg == 0.0:
        return ""
    along = f"{abs(along_s):.2f} s {'late' if along_s >= 0.0 else 'early'}"
    return f"{along}, {across_deg:+.3f} deg across, by a person"

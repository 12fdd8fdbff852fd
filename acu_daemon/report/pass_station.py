"""What the station said of a pass: how it came out by the schedule, and the phantom pass beside what came.  Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from acu_daemon.control.phantom import LostSpan, PhantomPass
from acu_daemon.daemon.service import PassJob
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.page_parts import Figures, table, text, time_of_day
from acu_daemon.report.pass_watch import PassWatch, SeenReading, seconds_where


@dataclass(frozen=True, slots=True)
class StationRecord:
    """What is kept beside the recording.  hooks: how each ended; running_hooks: those that had not."""

    state: str
    reason: str
    locked_s: float
    phantom: PhantomPass | None
    hooks: tuple[Mapping[str, Any], ...]
    running_hooks: tuple[str, ...]


def station_figures(record: StationRecord, job: PassJob, watch: PassWatch) -> dict[str, Any]:
    """What the report shows of it; JSON."""
    return {
        "state": record.state,
        "reason": record.reason,
        "locked_s": round(record.locked_s, 1),
        "phantom": None if record.phantom is None else _phantom(record.phantom, job, watch),
        "running_hooks": list(record.running_hooks),
    }


def _phantom(found: PhantomPass, job: PassJob, watch: PassWatch) -> dict[str, Any]:
    """came_...: the same of the readings of the pass, half the beam being the same."""
    coming, half_deg = job.coming, job.control.beamwidth_deg / 2.0
    seen: list[SeenReading] = []
    hidden: tuple[tuple[float, float], ...] = ()
    if coming is not None:
        hidden = coming.hidden_tai_s
        seen = [one for one in watch.readings if coming.rise_tai_s <= one.tai_s <= coming.set_tai_s]
    up = [one for one in seen if not any(begin <= one.tai_s <= end for begin, end in hidden)]
    near = [one.off_path_deg for one in up if one.off_path_deg is not None and one.off_path_deg <= half_deg]
    on_path_s, lost_s = _seconds(up, half_deg, is_near=True), _seconds(up, half_deg, is_near=False)
    return {
        "words": str(found),
        "no_go": found.no_go,
        "up_s": round(found.up_s, 1),
        "on_path_s": round(found.on_path_s, 1),
        "lost_s": round(found.up_s - found.on_path_s, 1),
        "largest_off_deg": round(found.largest_off_deg, 3),
        "came_up_s": round(on_path_s + lost_s, 1),
        "came_on_path_s": round(on_path_s, 1),
        "came_lost_s": round(lost_s, 1),
        "came_largest_off_deg": round(max(near), 3) if near else None,
        "lost": [_lost(one, seen, half_deg) for one in found.lost],
        "told": list(found.told),
        "kept_back": list(found.kept_back),
    }


def _lost(one: LostSpan, seen: Sequence[SeenReading], half_deg: float) -> dict[str, Any]:
    within = [each for each in seen if one.from_tai_s <= each.tai_s <= one.to_tai_s]
    return {
        "from_utc": utc_text(one.from_tai_s, 1),
        "lasted_s": round(one.to_tai_s - one.from_tai_s, 1),
        "why": one.why,
        "came_lost_s": round(_seconds(within, half_deg, is_near=False), 1),
    }


def _seconds(readings: Sequence[SeenReading], half_deg: float, *, is_near: bool) -> float:
    """How long the antenna was within half the beam of the path, or out of it."""
    return seconds_where(
        readings, lambda one: one.off_path_deg is not None and (one.off_path_deg <= half_deg) == is_near
    )


def station_section(figures: Figures) -> str:
    """HTML; nothing of a run without a schedule."""
    found = figures["station"]
    if found is None:
        return ""
    said = f"{escape(found['state'])}: {escape(found['reason'])}" if found["reason"] else escape(found["state"])
    title = "<h2>By the schedule, and the phantom pass</h2>"
    phantom = found["phantom"]
    if phantom is None:
        return f"{title}<p>{said}</p><p>The pass was not flown before it.</p>"
    rows = [
        ("above mask and lowest elevation, s", text(phantom["up_s"]), text(phantom["came_up_s"])),
        ("within half the beam of the path, s", text(phantom["on_path_s"]), text(phantom["came_on_path_s"])),
        ("farther off, s", text(phantom["lost_s"]), text(phantom["came_lost_s"])),
        ("largest distance within, °", text(phantom["largest_off_deg"]), text(phantom["came_largest_off_deg"])),
    ]
    lost = [
        (time_of_day(one["from_utc"]), escape(one["why"]), text(one["lasted_s"]), text(one["came_lost_s"]))
        for one in phantom["lost"]
    ]
    losses = table(("lost from UTC", "why", "phantom, s", "came, s"), lost, (2, 3)) if lost else ""
    words = [phantom["no_go"], *phantom["told"], *(f"kept back: {one}" for one in phantom["kept_back"])]
    told = "".join(f"<p>{escape(one)}</p>" for one in words if one)
    return f"{title}<p>{said}</p>{table(('', 'phantom pass', 'came'), rows, (1, 2))}{losses}{told}"

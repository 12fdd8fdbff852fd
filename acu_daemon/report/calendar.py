"""Granted passes as a calendar that phones and desktops read (RFC 5545)."""

from collections.abc import Iterable

from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import Entry

_LONGEST_BYTES = 75  # of a line, RFC 5545 section 3.1


def calendar_text(entries: Iterable[Entry], station: str, now_tai_s: float) -> str:
    """The calendar, lines ended as the standard has it."""
    lines = ["BEGIN:VCALENDAR", "VERSION:2.0", "PRODID:-//acu-daemon//schedule//EN"]
    for one in entries:
        start_tai_s = one.rise_tai_s if one.start_tai_s is None else one.start_tai_s
        end_tai_s = one.set_tai_s if one.end_tai_s is None else one.end_tai_s
        about = f"priority {one.priority}, {one.useful_s:.0f} useful seconds {one.reason}".rstrip()
        lines += [
            "BEGIN:VEVENT",
            f"UID:{_escaped(one.satellite)}-{_stamp(one.culmination_tai_s)[:13]}-{one.part}@acu-daemon",
            f"DTSTAMP:{_stamp(now_tai_s)}",
            f"DTSTART:{_stamp(start_tai_s)}",
            f"DTEND:{_stamp(end_tai_s)}",
            f"SUMMARY:{_escaped(one.satellite)}\\, {one.culmination_el_deg:.0f} deg",
            f"LOCATION:{_escaped(station)}",
            f"DESCRIPTION:{_escaped(about)}",
            "END:VEVENT",
        ]
    lines.append("END:VCALENDAR")
    return "".join(f"{_folded(line)}\r\n" for line in lines)


def _stamp(tai_s: float) -> str:
    return utc_text(tai_s, 0)[:19].replace("-", "").replace(":", "") + "Z"


def _escaped(text: str) -> str:
    for sign in ("\\", ";", ","):
        text = text.replace(sign, f"\\{sign}")
    return text.replace("\n", "\\n")


def _folded(line: str) -> str:
    parts: list[str] = []
    part = ""
    for letter in line:
        if len((part + letter).encode()) > _LONGEST_BYTES - (1 if parts else 0):
            parts.append(part)
            part = ""
        part += letter
    return "\r\n ".join([*parts, part])

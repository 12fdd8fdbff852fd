#!/usr/bin/env python3
"""A week of a station in virtual time: ten real satellites, three priorities, wind, a reload, a pause, a SIGKILL a day.

scripts/station_week.py FILE [--days 7] [--lowest 45] [--no-refraction] [--begin UTC]     FILE: element sets, 3-line

Between passes the ACU is polled every five seconds and the schedule planned every half an hour, not every second and
every ten minutes: that saves most of the time, and nothing depends on it.  Says of every pass that was ever granted
whether it was tracked, and of each other one why not; that nothing is lost is checked against the passes that are found
without the schedule.  Exit status 1 where something is.
"""

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from acu_daemon.cli import schedule_keeper
from acu_daemon.cli.coming_passes import passes_by_epoch
from acu_daemon.cli.options import load_target
from acu_daemon.cli.schedule_plan import station_plan
from acu_daemon.cli.virtual_station import Action, KilledError, StationAccess, run_days
from acu_daemon.config.load import satellite_names
from acu_daemon.daemon import foreground
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.schedule.rules import SAME_PASS_S
from acu_daemon.units import DAY_S

SATELLITES = {  # name in the file, and priority
    "noaa-20": ("NOAA 20 (JPSS-1)", 9),
    "noaa-21": ("NOAA 21 (JPSS-2)", 9),
    "suomi-npp": ("SUOMI NPP", 5),
    "metop-b": ("METOP-B", 9),
    "metop-c": ("METOP-C", 5),
    "fy-3d": ("FENGYUN 3D", 5),
    "fy-3e": ("FENGYUN 3E", 2),
    "meteor-3": ("METEOR-M2 3", 2),
    "meteor-4": ("METEOR-M2 4", 2),
    "sentinel-3a": ("SENTINEL-3A", 5),
}
STATION = """
[station]
latitude_deg = 46.5
longitude_deg = 7.9
height_m = 1000.0
min_elevation_deg = {lowest}
[acu]
url = "tcp://127.0.0.1:3842"
[acu.azimuth]
min_deg = -270.0
max_deg = 270.0
max_rate_deg_s = 15.0
max_acceleration_deg_s2 = 5.0
[acu.elevation]
min_deg = 0.0
max_deg = 90.0
max_rate_deg_s = 5.0
max_acceleration_deg_s2 = 5.0
[tracking]
preposition_s = 30.0
[atmosphere]
refraction = {refraction}
[schedule]
horizon_days = 0.5
pre_s = 30.0
after = "stow"
[wind]
file = "wind.json"
max_age_s = 3600
resume_after_s = 600
"""
CALM, STRONG = (4.0, 7.0), (14.0, 22.0)
RESTART_S = 20.0  # from a SIGKILL to the next start
WIND_S, PAUSE_S, TELL_S = 2400.0, 18000.0, 1800
TRACKED = (PassState.DONE, PassState.DEGRADED)


@dataclass(frozen=True, slots=True)
class Week:
    """What came out: the book, which of it was ever granted, what is wrong, and the seconds of a processor."""

    book: tuple[Entry, ...]
    granted: frozenset[int]
    kill_count: int
    wrong: tuple[str, ...]
    cpu_s: float

    @property
    def tracked(self) -> list[Entry]:
        return [one for one in self.book if one.state in TRACKED]


def main() -> None:
    arguments = _arguments()
    begin_tai_s = tai_from_utc(arguments.begin)
    with tempfile.TemporaryDirectory() as folder:
        sets = arguments.file.read_text()
        config = write_config(
            Path(folder) / "config", sets, arguments.lowest, has_refraction=not arguments.no_refraction
        )
        week = run_week(config, Path(folder) / "state", begin_tai_s, arguments.days)
    report(week)
    sys.exit(1 if week.wrong else 0)


def write_config(config: Path, sets: str, lowest_deg: float, *, has_refraction: bool = True) -> Path:
    """station.toml, and ten satellites with their element sets."""
    (config / "satellites").mkdir(parents=True)
    (config / "station.toml").write_text(STATION.format(lowest=lowest_deg, refraction=str(has_refraction).lower()))
    lines = [line.rstrip() for line in sets.splitlines()]
    for name, (title, priority) in SATELLITES.items():
        at = lines.index(title)
        (config / "satellites" / f"{name}.tle").write_text("\n".join(lines[at : at + 3]) + "\n")
        may_be_cut = str(priority == 5).lower()
        (config / "satellites" / f"{name}.toml").write_text(
            f'[satellite]\nname = "{name}"\n[elements]\nkind = "tle"\nfile = "{name}.tle"\n'
            f"[schedule]\npriority = {priority}\nmin_useful_s = 40\nmay_be_cut = {may_be_cut}\n"
        )
    return config


def run_week(config: Path, state: Path, begin_tai_s: float, days: int) -> Week:
    """Run it from kill to kill, each in mid-pass."""
    state.mkdir()
    foreground.REST_S, schedule_keeper.PLAN_S = 5.0, 1800.0
    begun_s, now_tai_s, end_tai_s = time.process_time(), begin_tai_s, begin_tai_s + days * DAY_S
    done = None
    events, kills = happenings(config, begin_tai_s, days), 0
    blow(config, CALM, now_tai_s)
    while now_tai_s < end_tai_s:
        kill_tai_s = _middle_of_a_pass(config, max(now_tai_s + 3600.0, begin_tai_s + kills * DAY_S), end_tai_s)
        script: list[tuple[float, Action]] = [one for one in events if now_tai_s <= one[0]]
        if kill_tai_s is not None:
            script.append((kill_tai_s, _kill))
        done = run_days(
            config, state, now_tai_s, end_tai_s, script=script, has_phantom=True, keeps_rows=False, before=done
        )
        print(f"until {utc_text(kill_tai_s or end_tai_s, 0)}: {time.process_time() - begun_s:.0f} s", file=sys.stderr)
        if done.outcome is not None or kill_tai_s is None:
            break
        kills, now_tai_s = kills + 1, kill_tai_s + RESTART_S
    with ScheduleFile(state, is_read_only=True) as file:
        book = file.book(begin_tai_s)
        past = [one for one in book if one.rise_tai_s < end_tai_s - 3600.0]
        granted = {one.number for one in past if any(s == PassState.PLANNED for _, s, _ in file.history(one.number))}
    wrong = tuple(faults(config, past, granted, begin_tai_s, end_tai_s - 3600.0))
    return Week(tuple(past), frozenset(granted), kills, wrong, time.process_time() - begun_s)


def happenings(config: Path, begin_tai_s: float, days: int) -> list[tuple[float, Action]]:
    """Wind in a pass of the second day, a reload on the third, a pause on the fourth; of fewer days on the last."""
    at = [begin_tai_s + min(day, days - 1) * DAY_S for day in (1, 2, 3)]
    calm_s = 3600.0 if days > 1 else 14400.0  # of one day, not in the pass of the kill
    windy_tai_s = _middle_of_a_pass(config, at[0] + calm_s, at[0] + 2.0 * DAY_S) or at[0]
    pause_tai_s = at[2] + 36000.0
    told = [begin_tai_s + at_s for at_s in range(0, round(days * DAY_S), TELL_S)]
    winds = [(tai_s, STRONG if 0.0 <= tai_s - windy_tai_s < WIND_S else CALM) for tai_s in told]
    winds += [(windy_tai_s, STRONG), (windy_tai_s + WIND_S, CALM)]
    return [
        *((tai_s, partial(_tell, wind=wind, now_tai_s=tai_s)) for tai_s, wind in winds),
        (at[1] + 30000.0, _reload),
        (pause_tai_s, partial(_pause, until_tai_s=pause_tai_s + PAUSE_S)),
    ]


def _middle_of_a_pass(config: Path, from_tai_s: float, to_tai_s: float) -> float | None:
    plan = station_plan(config, from_tai_s)
    slots = [one.slot for one in plan.decisions if one.slot is not None and one.slot.start_tai_s > from_tai_s]
    middles = sorted((slot.start_tai_s + slot.end_tai_s) / 2.0 for slot in slots)
    return next((middle for middle in middles if middle < to_tai_s), None)


def blow(config: Path, wind: tuple[float, float], now_tai_s: float) -> None:
    """Tell the wind."""
    said = {"mean_m_s": wind[0], "gust_m_s": wind[1], "utc": utc_text(now_tai_s)}
    (config / "wind.json").write_text(json.dumps(said))


def _tell(access: StationAccess, wind: tuple[float, float], now_tai_s: float) -> None:
    blow(access.config, wind, now_tai_s)


def _kill(_access: StationAccess) -> None:
    raise KilledError


def _reload(access: StationAccess) -> None:
    path = access.config / "satellites" / "meteor-3.toml"
    if path.exists():
        path.write_text(path.read_text().replace("priority = 2", "priority = 9"))
    access.runs.answer("reload", "the script")


def _pause(access: StationAccess, until_tai_s: float) -> None:
    access.runs.answer(f"pause until={utc_text(until_tai_s, 0)}", "the script")


def faults(config: Path, book: Sequence[Entry], granted: set[int], from_tai_s: float, to_tai_s: float) -> list[str]:
    """What is wrong: a pass that the book has not, one without a reason, one that was granted and not tracked."""
    found = []
    for name in satellite_names(config):
        target = load_target(config, name, from_tai_s, is_strict=False)
        for _, passes in passes_by_epoch(config, name, target, from_tai_s, to_tai_s):
            for one in passes:
                is_kept = any(
                    entry.satellite == name and abs(entry.culmination_tai_s - one.culmination_tai_s) < SAME_PASS_S
                    for entry in book
                )
                if not is_kept and one.rise_tai_s > from_tai_s + 60.0 and one.set_tai_s < to_tai_s:
                    found.append(f"lost: {name} at {utc_text(one.rise_tai_s, 0)}")
    for entry in book:
        if not entry.reason or entry.state in (PassState.PLANNED, PassState.PREPASS, PassState.PASS):
            found.append(f"no end: {entry.name}: {entry.state} ({entry.reason})")
        if entry.number in granted and entry.state not in TRACKED and not is_excused(entry):
            found.append(f"granted and not tracked: {entry.name}: {entry.state} ({entry.reason})")
    return found


def is_excused(entry: Entry) -> bool:
    """Whether wind, a person, or a plan that was made anew took the antenna from a pass; a kill is no excuse."""
    words = ("wind", "paused by a person", "lost to", "skipped", "useful for", "cannot be there in time")
    return any(word in entry.reason for word in words)


def report(week: Week) -> None:
    """Print the figures, and every pass that was granted and not wholly tracked."""
    counts = f"{len(week.granted)} ever granted, {len(week.tracked)} tracked"
    print(f"{len(week.book)} passes, {counts}, {week.kill_count} kills")
    for state, count in Counter(str(one.state) for one in week.book).most_common():
        print(f"  {state}: {count}")
    for one in week.book:
        if one.number in week.granted and one.state is not PassState.DONE:
            print(f"  {one.name}: {one.state} ({one.reason})")
    for what in week.wrong:
        print(f"WRONG {what}")
    print(f"{week.cpu_s:.0f} s of a processor")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--days", type=int, default=7)
    parser.add_argument("--lowest", type=float, default=45.0, help="lowest elevation, deg: fewer and shorter passes")
    parser.add_argument("--no-refraction", action="store_true")
    parser.add_argument("--begin", default="2026-05-30T00:00:00Z")
    return parser.parse_args()


if __name__ == "__main__":
    main()

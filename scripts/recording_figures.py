#!/usr/bin/env python3
"""The figures of docs/recordings.md: a whole pass of the demo's satellite with three losses, and what is made of it.

    .venv/bin/python scripts/recording_figures.py        the figures, in a minute
    .venv/bin/python scripts/recording_figures.py DIR    the same; recording, report, index and messages stay in DIR

The pass is flown in virtual time, so that every command and every fit is the same on each run; what takes time is of
this machine.  The satellite is late and beside its elements, as in all flights of the tests.
"""

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from flights import DEMO_TAI_S, WRONG_ORBIT, demo_target, flight_of

from acu_daemon.assist.session.refit import RefitReply
from acu_daemon.cli.options import coming_pass
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.cli.report_command import make_report, write_index
from acu_daemon.edge.tape import Record
from acu_daemon.edge.tape_file import SUFFIX, TapeFile, read_tape
from acu_daemon.edge.tape_text import FitAnswer
from acu_daemon.model import Correction, Site, Station, sky_angle_deg
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.sim.sky import DelayedPropagator
from acu_daemon.units import DAY_S, DEG

EARLY_S, LATE_S = 30.0, 10.0  # flown before the rise and after the set
LOSSES = ((150.0, 180.0), (300.0, 345.0), (480.0, 540.0))  # seconds from the begin of the flight
LOWEST_DEG = 5.0
TURNS = 3
NEXT = {  # station: latitude, longitude, and which of its passes in the next half day
    "40 N 75 W": (40.0, -75.0, (0,)),
    "70 N 20 E": (70.0, 20.0, (0,)),
    "50 N 8 E": (50.0, 8.0, (0,)),
    "35 S 149 E": (-35.0, 149.0, (0, 1)),
}


class Kept:
    """Keeps the jobs of a recording, to be done when they are asked for."""

    problem = ""

    def __init__(self) -> None:
        self.jobs: list[Any] = []

    def put(self, job: Any) -> bool:
        self.jobs.append(job)
        return True


def fly_pass(path: Path) -> float:
    """Fly it, and keep its recording; the end, TAI s."""
    target = demo_target()
    coming = coming_pass(target, DEMO_TAI_S)
    begin, end = coming.rise_tai_s - EARLY_S, coming.set_tai_s + LATE_S
    antenna = AcuChoice(azimuth_deg=170.0, elevation_deg=5.0)
    flight_of(target, begin, end - begin, antenna=antenna, losses=LOSSES, tape=path)
    return end


def replay_line(path: Path, *, fits_anew: bool) -> str:
    begun_s = time.process_time()
    done = replay_pass(path, fits_anew=fits_anew)
    took_s = time.process_time() - begun_s
    said = "every one the same" if done.difference is None else f"DIFFERS: {done.difference}"
    how = "computed again" if fits_anew else "as recorded"
    count = done.replay.command_count
    return f"replay, {done.replay.fit_count} fits {how}: {count} commands, {said}; {took_s:.1f} s of processor"


def cost_line(path: Path) -> str:
    """What the recording of each tick takes the loop and the thread, the best of three."""
    records = [_as_noted(one) for one in read_tape(path).records()]
    tick_count = sum(one[0] == "T" for one in records)
    loop_s, thread_s = [], []
    for _ in range(TURNS):
        writer: Any = Kept()
        with tempfile.TemporaryDirectory() as folder:
            tape = TapeFile(Path(folder) / f"cost{SUFFIX}", {}, writer)
            begun_s = time.process_time()
            for record in records:
                tape.note(record)
            loop_s.append(time.process_time() - begun_s)
            begun_s = time.process_time()
            for job in writer.jobs:
                job()
            thread_s.append(time.process_time() - begun_s)
    per_tick = [1e6 * min(found) / tick_count for found in (loop_s, thread_s)]
    return f"a tick with its share of the fits: {per_tick[0]:.1f} us in the loop, {per_tick[1]:.0f} us in the thread"


def _as_noted(record: Record) -> Record:
    """A record that was read, as it is written."""
    match record:
        case ("F", FitAnswer(fit, notes, model, gate)):
            prediction: Any = None  # which is not written
            return "F", RefitReply(fit, prediction, notes, model, gate)
    return record


def off_deg(source: Propagator, truth: Propagator, tai_s: float, station: Station) -> float:
    a, b = (look_at(one, np.array([tai_s]), Site(station)) for one in (source, truth))
    return sky_angle_deg(float(a.az_deg[0]), float(a.el_deg[0]), float(b.az_deg[0]), float(b.el_deg[0]))


def next_stations(omm: Path, now_tai_s: float) -> None:
    """How far elements are off at the next rises of others: as they came, and as they were fitted."""
    (elements,), _ = parse_omm(omm.read_text(), omm.name)
    catalogue, fitted = demo_target().elements.propagator, Sgp4Propagator(elements)
    beside = catalogue.corrected(Correction(delta_raan_rad=WRONG_ORBIT.delta_raan_deg * DEG))
    truth = DelayedPropagator(beside, WRONG_ORBIT.along_track_s)
    print("| station | rise after | catalogue, deg | fitted orbit, deg |\n|---|---|---|---|")
    for name, (latitude_deg, longitude_deg, which) in NEXT.items():
        station = Station(name, latitude_deg, longitude_deg, 0.0)
        passes = find_passes(truth, Site(station), now_tai_s, now_tai_s + DAY_S, LOWEST_DEG)
        for k in which:
            rise = passes[k].rise_tai_s
            both = " | ".join(f"{off_deg(one, truth, rise, station):.4f}" for one in (catalogue, fitted))
            print(f"| {name} | {(rise - now_tai_s) / 3600.0:.1f} h | {both} |")


def figures(folder: Path) -> None:
    path = folder / f"pass{SUFFIX}"
    end_tai_s = fly_pass(path)
    lines = read_tape(path).lines
    share = sum(len(line) for line in lines if line.startswith("F")) / sum(map(len, lines))
    print(f"recording: {path.stat().st_size / 1e3:.0f} kB; of its text {share:.0%} are fits")
    for fits_anew in (False, True):
        print(replay_line(path, fits_anew=fits_anew))
    print(cost_line(path))
    done, page = make_report(path, folder)
    write_index(folder)
    sizes = [f"{one.stat().st_size / 1e3:.0f} kB" for one in (page, page.with_suffix(".json"))]
    print(f"report of {done.replay.tick_count} ticks: {sizes[0]} of HTML, {sizes[1]} of JSON")
    next_stations(page.with_suffix(".omm"), end_tai_s)


def main() -> None:
    with tempfile.TemporaryDirectory() as made:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else made)
        folder.mkdir(parents=True, exist_ok=True)
        figures(folder)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""A day of passes in virtual time, with random faults: every pass must be held, and nothing may grow.

scripts/soak.py                          14 passes in 24 hours of 10 Hz ticks, on what each left to the next
scripts/soak.py --passes 2 --quick       two, and no daemon in the hours between them

One process, one loop, one simulated ACU and one state directory for the whole day; a daemon for each pass, as `run`
starts it.  In each pass the signal is lost once or twice, two faults of the vocabulary happen, and in one pass of three
the daemon is killed.  An operator clears a latch, and arms again what another hand has stopped.  All promises are
watched all day (tests/promise_judge.py).

A pass is held when the satellite was acquired, the beam was on it (0.1 deg) each time the signal came back, and it was
acquired again in time after every fault.  Where the drive cannot follow (above 80 deg) and for RECOVER_S after a fault
only the latter counts.
"""

import argparse
import ctypes
import gc
import json
import os
import resource
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from flights import changed, demo_target, sky_of
from promise_judge import SPOILING
from promise_rig import Rig, Scene

from acu_daemon.cli.options import coming_pass
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.sim.fault_verbs import FRAME_VERBS, VERBS, fault_text, parse_fault
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.sim.trace import TraceRow

DAY_UTC = "2026-08-18T12:30:00Z"
POLAR = {"name": "Svalbard", "latitude_deg": 78.23, "longitude_deg": 15.39, "height_m": 450.0}  # sees every orbit
ON_PATH_DEG = 0.1
RECOVER_S = 6.0  # back-off, the start's exchanges, and the way back to the path
AGAIN_S = 30.0  # from the end of a fault, or of the loss in which it was, to acquired again
FOLLOWS_EL_DEG = 80.0
LEAD_S = 150.0  # before the rise, with --quick
STEP_S = 1.0
MAY_GROW_MB = 5.0
NOT_DRAWN = {"silence"}  # the losses are that


@dataclass
class PassSeen:
    """One pass of the day."""

    rise_utc: str
    culmination_deg: float
    faults: list[str]
    is_killed: bool
    is_held: bool = False
    why_not: list[str] = field(default_factory=list)
    relock_deg: list[float] = field(default_factory=list)
    worst_hold_deg: float = 0.0
    latches: list[str] = field(default_factory=list)
    refusal_count: int = 0
    rss_mb: float = 0.0
    object_count: int = 0
    block_count: int = 0  # allocated by Python
    descriptor_count: int = 0
    cpu_s: float = 0.0


@dataclass(frozen=True)
class Plan:
    """What happens in a pass; times in seconds from its rise."""

    losses: tuple[tuple[float, float], ...]
    faults: tuple[str, ...]  # begin within the pass; start_s is from the rise
    kill_s: float | None

    def disturbed(self) -> list[tuple[float, float]]:
        """When the daemon or the antenna cannot do what is asked."""
        spans = [(fault.start_s, fault.start_s + (fault.duration_s or 0.0)) for fault in map(parse_fault, self.faults)]
        return spans + ([(self.kill_s, self.kill_s + 3.0)] if self.kill_s is not None else [])


def draw_plan(duration_s: float, random: Random) -> Plan:
    """One or two losses, two faults (one of them in a loss), and now and then a kill."""
    first = random.uniform(0.15, 0.3) * duration_s
    losses = [(first, first + random.uniform(15.0, 60.0))]
    if random.random() < 0.5:
        second = random.uniform(0.6, 0.7) * duration_s
        losses.append((second, second + random.uniform(10.0, 40.0)))
    faults = []
    begin, end = losses[0]
    for at_s in (random.uniform(begin, end), random.uniform(0.45, 0.58) * duration_s):
        verb = random.choice(sorted(set(VERBS) - NOT_DRAWN))
        keys = f"start_s={at_s:.2f} duration_s={random.uniform(0.5, 6.0):.2f}"
        if verb in FRAME_VERBS:
            keys += f" probability={random.choice([1.0, 0.5, 0.2])} seed={random.randrange(1000)}"
        elif VERBS[verb].place == "pedestal":
            keys += f" axis={random.choice(['azimuth', 'elevation', 'both'])}"
        faults.append(f"{verb} {keys}")
    kill_s = random.uniform(begin, 0.9 * duration_s) if random.random() < 1 / 3 else None
    return Plan(tuple(losses), tuple(faults), kill_s)


class Soak:
    """The day; a mutable object with one owner, the main program."""

    def __init__(self, directory: Path, seed: int, *, is_quick: bool) -> None:
        target = changed(demo_target(), station=POLAR)
        begin_tai_s = tai_from_utc(DAY_UTC)
        coming = coming_pass(target, begin_tai_s)
        if is_quick:
            begin_tai_s = coming.rise_tai_s - LEAD_S
        scene = Scene(target, sky_of(target), begin_tai_s, AcuChoice(), coming)
        self._random = Random(seed)
        self._is_quick = is_quick
        self.rig = Rig(directory, scene, runs_on=True, seed=seed)

    @property
    def now_tai_s(self) -> float:
        return self.rig.clock.tai_s()

    def fly(self) -> PassSeen:
        """The next pass, from the wait for it to its end."""
        rig, coming, begun_s = self.rig, self.rig.coming, time.process_time()
        plan = draw_plan(coming.duration_s, self._random)
        seen = PassSeen(utc_text(coming.rise_tai_s, 0), round(coming.culmination_el_deg, 1), list(plan.faults), False)
        if (wait_s := coming.rise_tai_s - 10.0 - self.now_tai_s) > 0.0:
            rig.wait(wait_s)
        watch = Watch(seen, plan, coming.rise_tai_s)
        rig.acu.observer = watch.see
        rise_in_s = coming.rise_tai_s - self.now_tai_s
        for begin_s, end_s in plan.losses:
            rig.fault(f"silence start_s={rise_in_s + begin_s} duration_s={end_s - begin_s}")
        for text in plan.faults:
            fault = parse_fault(text)
            rig.judge.is_spoiled |= fault.verb.startswith(SPOILING)
            rig.fault(text.replace(f"start_s={fault.start_s:.2f}", f"start_s={rise_in_s + fault.start_s:.2f}"))
        self._serve(plan, coming.rise_tai_s, seen, watch)
        rig.acu.observer = None
        watch.end()
        rig.clear_faults()
        rig.judge.is_spoiled = False
        rig.judge.read_files()
        seen.why_not += [f"{promise}: {what}" for promise, what in rig.judge.broken.items()]
        rig.judge.broken.clear()
        outcome = rig.outcomes.pop()
        seen.refusal_count = outcome.refusal_count
        seen.is_held = not seen.why_not
        seen.cpu_s = round(time.process_time() - begun_s, 1)
        return seen

    def _serve(self, plan: Plan, rise_tai_s: float, seen: PassSeen, watch: "Watch") -> None:
        """Let the pass happen, with the operator at hand."""
        rig, kill_s = self.rig, plan.kill_s
        while not rig.outcomes:
            rig.wait(STEP_S)
            since_rise_s, state = self.now_tai_s - rise_tai_s, rig.state
            if kill_s is not None and since_rise_s >= kill_s and not rig.outcomes:
                kill_s, seen.is_killed = None, True
                rig.crash(0.5)
            is_wrong = bool(state.latch.problem) or bool(state.arming.disarmed_by)
            is_over = all(end_s + 1.0 < since_rise_s or begin_s > since_rise_s for begin_s, end_s in plan.disturbed())
            if is_wrong and is_over and not rig.outcomes:
                seen.latches.append(state.latch.problem or state.arming.disarmed_by)
                rig.ask("clear")
                rig.ask("arm")
                watch.mended(since_rise_s)

    def begin_next(self) -> None:
        """The next run; with --quick nobody waits in the hours between."""
        rig = self.rig
        if self._is_quick:
            coming = coming_pass(rig.scene.target, self.now_tai_s)
            rig.skip(max(0.0, coming.rise_tai_s - LEAD_S - self.now_tai_s))
        rig.start()

    def note_memory(self, seen: PassSeen) -> None:
        """What the process holds now, without what the allocator keeps for later."""
        gc.collect()
        ctypes.CDLL(None).malloc_trim(0)
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        seen.rss_mb = round(pages * resource.getpagesize() / 1e6, 2)
        seen.object_count, seen.block_count = len(gc.get_objects()), sys.getallocatedblocks()
        seen.descriptor_count = len(os.listdir("/proc/self/fd"))  # noqa: PTH208


class Watch:
    """Looks at a pass as it happens, ten times a second, and keeps no more than it must."""

    def __init__(self, seen: PassSeen, plan: Plan, rise_tai_s: float) -> None:
        self._seen, self._rise_tai_s = seen, rise_tai_s
        self._disturbed = [(begin_s, end_s + RECOVER_S) for begin_s, end_s in plan.disturbed()]
        self._longest_away_s = max(end_s - begin_s for begin_s, end_s in plan.disturbed()) + AGAIN_S
        self._had_signal = self._has_acquired = False
        self._away_from_s: float | None = None
        self._worst_away_s = 0.0

    def mended(self, time_s: float) -> None:
        """The operator has cleared a latch, or armed: the way back to the path begins."""
        self._disturbed.append((time_s, time_s + AGAIN_S))
        self._away_from_s = None

    def see(self, row: TraceRow) -> None:
        """One more instant."""
        time_s, error_deg, had_signal = row.tai_s - self._rise_tai_s, row.beam_error_deg, self._had_signal
        self._has_acquired |= row.is_acquired
        self._had_signal = row.has_signal
        if error_deg is None or row.satellite_el_deg is None or not self._has_acquired:
            return
        self._note_absence(time_s, is_away=row.has_signal and not row.is_acquired)
        if row.satellite_el_deg > FOLLOWS_EL_DEG or any(begin <= time_s <= end for begin, end in self._disturbed):
            return
        if not row.has_signal:
            self._seen.worst_hold_deg = max(self._seen.worst_hold_deg, round(error_deg, 3))
        elif not had_signal:
            self._seen.relock_deg.append(round(error_deg, 3))
            if error_deg > ON_PATH_DEG:
                self._seen.why_not.append(f"{error_deg:.2f} deg when the signal came back at {time_s:.1f} s")

    def _note_absence(self, time_s: float, *, is_away: bool) -> None:
        if not is_away:
            self._away_from_s = None
            return
        self._away_from_s = time_s if self._away_from_s is None else self._away_from_s
        self._worst_away_s = max(self._worst_away_s, time_s - self._away_from_s)

    def end(self) -> None:
        """Say what was missed."""
        if not self._has_acquired:
            self._seen.why_not.append("never acquired")
        if self._worst_away_s > self._longest_away_s:
            self._seen.why_not.append(f"not acquired for {self._worst_away_s:.1f} s of signal")


def main() -> None:
    """Run the day and print its figures; the exit status is 1 where one falls short."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=24.0, help="at most so long (default %(default)g)")
    parser.add_argument("--passes", type=int, default=14, help="at most so many (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="another seed, other faults")
    parser.add_argument("--quick", action="store_true", help="no daemon between the passes")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there too")
    options = parser.parse_args()
    report = soak(options.passes, options.hours, options.seed, is_quick=options.quick)
    if options.json is not None:
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="ascii")
    sys.exit(0 if report["is_good"] else 1)


def soak(passes: int, hours: float, seed: int, *, is_quick: bool) -> dict[str, object]:
    """Fly them all and print a line for each."""
    print(f"SIMULATION, virtual time, from {DAY_UTC}, seed {seed}")
    flown: list[PassSeen] = []
    with tempfile.TemporaryDirectory(prefix="soak-") as directory:
        day = Soak(Path(directory), seed, is_quick=is_quick)
        with day.rig as rig:
            end_tai_s = day.now_tai_s + 3600.0 * hours
            while len(flown) < passes and rig.coming.set_tai_s < end_tai_s:
                if flown:
                    day.begin_next()
                seen = day.fly()
                day.note_memory(seen)
                flown.append(seen)
                print(line_of(len(flown), seen), flush=True)
            virtual_h = (day.now_tai_s - rig.scene.begin_tai_s) / 3600.0
    return summary(flown, virtual_h, rig.judge.tick_count, seed)


def line_of(number: int, seen: PassSeen) -> str:
    """One pass, for people."""
    verbs = ", ".join(fault_text(parse_fault(text)).split()[0] for text in seen.faults) + ", kill" * seen.is_killed
    relocks = " ".join(f"{error_deg:.3f}" for error_deg in seen.relock_deg)
    return (
        f"{number:2} {seen.rise_utc} to {seen.culmination_deg:4.1f} deg: {'held' if seen.is_held else 'NOT HELD'}; "
        f"{verbs}; relock {relocks or '-'} deg; {seen.rss_mb:.1f} MB, {seen.object_count} objects, "
        f"{seen.descriptor_count} descriptors; {seen.cpu_s:.0f} s"
        + "".join(f"\n     {why}" for why in seen.why_not)
        + "".join(f"\n     operator: {latch}" for latch in seen.latches)
    )


def summary(flown: list[PassSeen], virtual_h: float, ticks: int, seed: int) -> dict[str, object]:
    """The figures beside those asked."""
    held = sum(seen.is_held for seen in flown)
    second = flown[min(1, len(flown) - 1)]
    grown_mb = flown[-1].rss_mb - second.rss_mb
    descriptors = {seen.descriptor_count for seen in flown}
    refusals = sum(seen.refusal_count for seen in flown)
    print(
        f"{virtual_h:.1f} h, {ticks} ticks; held {held} of {len(flown)}; memory grew by {grown_mb:+.2f} MB from the "
        f"second pass to the last (asked: <= {MAY_GROW_MB:g}); descriptors {sorted(descriptors)}; "
        f"refused commands {refusals}"
    )
    is_good = held == len(flown) and grown_mb <= MAY_GROW_MB and len(descriptors) == 1
    return {
        "is_good": is_good,
        "seed": seed,
        "virtual_h": round(virtual_h, 2),
        "tick_count": ticks,
        "held_count": held,
        "grown_mb": round(grown_mb, 2),
        "passes": [asdict(seen) for seen in flown],
    }


if __name__ == "__main__":
    main()

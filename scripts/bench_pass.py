#!/usr/bin/env python3
"""Bench one satellite pass in real time: the real daemon against the simulated ACU, each a process of its own.

What it does
  1. Takes a real pass of ../shared/data/passes (element set and true sky), or the demo's satellite where that folder is
     absent, and writes a configuration and a scenario: encoder noise of 0.03 deg, no signal from 40 % to 75 %.
  2. Starts `acu-daemon fake-acu` and `acu-daemon run` with one shared clock, for each link asked for:
       tcp   loopback TCP
       pty   a pseudo terminal paced at 9600 baud in both directions
  3. Reads what the simulated ACU saw, prints asked and measured figures side by side, and says whether all are met.

Takes as long as the pass (8.5 minutes by default); with --window 60 a minute out of its middle.

Exit status: 0 all asked figures are met; 1 at least one is not; 2 the bench itself could not run.

Examples
  scripts/bench_pass.py --window 60                     both links side by side, one minute
  scripts/bench_pass.py --link tcp --json tcp.json      the whole pass over TCP, figures also as JSON
  scripts/bench_pass.py --pass jason-1-Cuiaba-20030108T1414     through the zenith, where the drive cannot follow
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from pass_rig import DEFAULT_PASS, LINKS, BenchError, Rig, make_scene, run_pass
from real_pass import pass_names
from tables.outputs import output_file

from acu_daemon.cli.options import load_target
from acu_daemon.drivers.sa3842.angles import LSB_DEG
from acu_daemon.errors import AcuDaemonError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.pass_trace import read_trace
from acu_daemon.report.wire import LossFigures, WriteFigures, measure_losses, measure_writes, read_writes

MIN_WINDOW_S = 45.0


@dataclass(frozen=True)
class Result:
    """What was measured on one link."""

    exit_status: int
    writes: WriteFigures
    losses: LossFigures
    tick_count: int
    skipped_tick_count: int
    lateness_p50_ms: float
    lateness_p99_ms: float
    refusal_count: int
    connect_count: int
    refit_count: int
    refit_failed_count: int


def measure(rig: Rig) -> Result:
    """Sum up a rig whose processes have ended.  BenchError: it has nothing to show."""
    done = rig.events("run.done")
    if rig.daemon is None or not done:
        raise BenchError(f"{rig.link}: the daemon did not finish: {rig.errors.read_text().strip() or rig.state}")
    station = load_target(rig.config, rig.scene.satellite, rig.scene.start_tai_s).station
    limits = station.acu.azimuth.limits(), station.acu.elevation.limits()
    trace = read_trace(rig.trace)
    counts = {name: done[0][name] for name in Result.__dataclass_fields__ if name in done[0]}
    try:
        writes = measure_writes(read_writes(rig.wire_log), trace, *limits, LSB_DEG)
        return Result(rig.daemon.returncode, writes, measure_losses(trace, *limits), **counts)
    except ValueError as error:
        raise BenchError(f"{rig.link}: {error}") from None


@dataclass(frozen=True)
class Row:
    """One line of the table; a figure nobody asked for is always met."""

    name: str
    asked: str
    shown: Callable[[Result], str]
    is_met: Callable[[Result], bool] = lambda _: True


ROWS = (
    Row(
        "beam error in the loss, largest, deg",
        "<= 0.1",
        lambda r: f"{r.losses.beam_error_max_deg:.3f}",
        lambda r: r.losses.beam_error_max_deg <= 0.1,
    ),
    Row("beam error in the loss, median, deg", "", lambda r: f"{r.losses.beam_error_median_deg:.3f}"),
    Row("length of the loss, s", "", lambda r: f"{r.losses.loss_s:.1f}"),
    Row("of which too fast for the drive, s", "", lambda r: f"{r.losses.cannot_follow_s:.1f}"),
    Row(
        "signal back to relock, s",
        "<= 1",
        lambda r: f"{r.losses.relock_s:.1f}",
        lambda r: r.losses.relock_s <= 1.0,
    ),
    Row(
        "register writes a second",
        "10.0 +- 0.1",
        lambda r: f"{r.writes.writes_per_s:.3f}",
        lambda r: abs(r.writes.writes_per_s - 10.0) <= 0.1,
    ),
    Row(
        "gaps up to 120 ms, %",
        ">= 99",
        lambda r: f"{100.0 * r.writes.share_of_short_gaps:.2f}",
        lambda r: r.writes.share_of_short_gaps >= 0.99,
    ),
    Row("longest gap, ms", "", lambda r: f"{1e3 * r.writes.longest_gap_s:.0f}"),
    Row(
        "followed registers / axis rate, %",
        "<= 100",
        lambda r: f"{100.0 * r.writes.rate_share:.1f}",
        lambda r: r.writes.rate_share <= 1.0,
    ),
    Row(
        "registers in autotrack, largest, deg",
        "<= 0.1",
        lambda r: f"{r.writes.autotrack_max_deg:.3f}",
        lambda r: r.writes.autotrack_max_deg <= 0.1,
    ),
    Row("registers in autotrack, 99 %, deg", "", lambda r: f"{r.writes.autotrack_p99_deg:.3f}"),
    Row("ticks / skipped", "", lambda r: f"{r.tick_count} / {r.skipped_tick_count}"),
    Row("ticks late, 50 % / 99 %, ms", "", lambda r: f"{r.lateness_p50_ms:.2f} / {r.lateness_p99_ms:.2f}"),
    Row("fits / failed", "", lambda r: f"{r.refit_count} / {r.refit_failed_count}"),
    Row("exit status of the daemon", "0", lambda r: str(r.exit_status), lambda r: r.exit_status == 0),
)


def missed(results: dict[str, Result]) -> list[str]:
    """Asked figures that were not met."""
    return [f"{link}: {row.name}" for link, result in results.items() for row in ROWS if not row.is_met(result)]


def table(results: dict[str, Result]) -> str:
    """Asked and measured, side by side."""
    lines = [f"{'':38}{'asked':>14}" + "".join(f"{link:>16}" for link in results)]
    for row in ROWS:
        cells = (row.shown(r) + (" " if row.is_met(r) else "!") for r in results.values())
        lines.append(f"{row.name:38}{row.asked:>14}" + "".join(f"{cell:>16}" for cell in cells))
    return "\n".join(lines)


def main() -> int:
    """Run the bench as the command line asks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--link", choices=(*LINKS, "both"), default="both", help="default: both, side by side")
    parser.add_argument("--pass", dest="pass_name", metavar="NAME", help=f"default: {DEFAULT_PASS}; demo: no real one")
    parser.add_argument(
        "--window", type=float, metavar="S", help="only this many seconds around the middle of the pass"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="keep traces and logs here (a new directory)")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="also write the figures here")
    options = parser.parse_args()
    if options.window is not None and not options.window >= MIN_WINDOW_S:
        parser.error(f"--window {options.window:g}: expected at least {MIN_WINDOW_S:g} s, to lock, lose and relock")
    pass_name = options.pass_name or (DEFAULT_PASS if pass_names() else "demo")
    links = LINKS if options.link == "both" else (options.link,)
    with tempfile.TemporaryDirectory(prefix="acu-daemon-bench-") as temporary:
        directory = options.out or Path(temporary) / "out"
        try:
            directory.mkdir(parents=True)
            scene = make_scene(directory, None if pass_name == "demo" else pass_name, options.window)
            seconds = scene.end_tai_s - scene.start_tai_s
            print(f"SIMULATION of {scene.label} from {utc_text(scene.start_tai_s, 0)}: {seconds:.0f} s in real time")
            results = {rig.link: measure(rig) for rig in run_pass(scene, links, directory, _say)}
        except (BenchError, AcuDaemonError, OSError) as error:
            print(f"bench_pass: {error}", file=sys.stderr)
            return 2
        except KeyboardInterrupt:
            return 130
    failed = missed(results)
    print("\n" + table(results))
    print("\nnot met: " + "; ".join(failed) if failed else "\nall asked figures are met")
    if options.json is not None:
        links_json = {link: asdict(result) for link, result in results.items()}
        about = {"pass": scene.label, "seconds": seconds, "is_window": scene.is_window}
        options.json.write_text(json.dumps({**about, "links": links_json, "missed": failed}, indent=1) + "\n")
    return 1 if failed else 0


def _say(text: str) -> None:
    print(text, flush=True)


if __name__ == "__main__":
    sys.exit(main())

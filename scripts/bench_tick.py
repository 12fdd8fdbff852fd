#!/usr/bin/env python3
"""Bench the daemon's ticks: the real daemon, locked, a fit each second, against the simulated ACU over TCP.

What it does
  For each condition it starts `acu-daemon fake-acu` and `acu-daemon run`, waits for the lock, and measures:
    idle     nothing beside it; also what one daemon costs: processor, memory with its fit process
    loaded   a busy loop on every core
    fifo     the same with the daemon under SCHED_FIFO, where this user may
    polled   status asked 50 times a second over the control socket, and the log at debug
  Beside each one runs cyclictest, or where that is not installed a bare loop that only sleeps: the machine's own limit.
  With --antennas it measures so many daemons at once instead, each with an ACU of its own, for each number given.

Prints Markdown tables, asked and measured.  Lateness is of all ticks, from the daemon's first on; skipped ticks,
processor and memory are of the time measured.  One core is 100 %.

Exit status: 0 all asked figures are met; 1 at least one is not; 2 the bench itself could not run.

Examples
  scripts/bench_tick.py                                 four conditions of ten minutes each
  scripts/bench_tick.py --only idle --seconds 60        one minute, idle
  scripts/bench_tick.py --antennas 4 8 16 --seconds 60  how many antennas this machine carries
"""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from tick_rig import CONDITIONS, BenchError, Condition, Ticks, run_condition

from acu_daemon.errors import AcuDaemonError

SECONDS = 600.0
LONGEST_S = 640.0  # of the demo's pass that remain beside the lock
SHORTEST_S = 3.0
COLOURS = ("#0b6e4f", "#e0b13a", "#c8553d")


@dataclass(frozen=True)
class Asked:
    """A figure asked for, and where it stands in the result."""

    text: str
    condition: str
    value: Callable[[Ticks], float]
    most: float


ASKED = (
    Asked("late 50 %, ms", "idle", lambda t: t.p50_ms, 0.3),
    Asked("late 99 %, ms", "idle", lambda t: t.p99_ms, 1.0),
    Asked("late max, ms", "idle", lambda t: t.max_ms, 5.0),
    Asked("processor with the fit, % of a core", "idle", lambda t: t.cpu_percent, 3.0),
    Asked("memory with the fit, MB", "idle", lambda t: t.memory_mb, 90.0),
    Asked("late 99 %, ms", "loaded", lambda t: t.p99_ms, 5.0),
    Asked("late 99 %, ms", "fifo", lambda t: t.p99_ms, 0.5),
    Asked("late 99 %, ms", "polled", lambda t: t.p99_ms, 2.0),
    *(Asked("ticks skipped", name, lambda t: float(t.skipped_tick_count), 0.0) for name in CONDITIONS),
)


def asked_rows(results: list[Ticks]) -> list[tuple[str, Ticks, Asked, bool]]:
    """Each asked figure that was measured, and whether it is met."""
    rows = []
    for result in results:
        for asked in ASKED:
            if result.antennas == 1 and asked.condition == result.condition and result.is_permitted:
                is_met = round(asked.value(result), 2) <= asked.most
                rows.append((f"{result.condition}: {asked.text}", result, asked, is_met))
    return rows


def conditions_table(results: list[Ticks]) -> str:
    """Markdown: a line for each condition, the machine's limit beside it."""
    limit = results[0].limit_name
    lines = [
        f"| condition | late 50 / 99 % / max, ms | {limit} 50 / 99 % / max, ms | ratio at 99 % | skipped of ticks "
        "| processor, % of a core (of that the fit) | memory, MB |",
        "|---|---|---|---|---|---|---|",
    ]
    for t in results:
        if not t.is_permitted:
            lines.append(f"| {t.condition} | SCHED_FIFO is not permitted to this user | | | | | |")
            continue
        ratio = t.p99_ms / t.limit_p99_ms if t.limit_p99_ms else float("nan")
        polled = f", {t.status_count / t.seconds:.0f} status/s" if t.status_count else ""
        lines.append(
            f"| {t.condition}{polled} | {_three(t.p50_ms, t.p99_ms, t.max_ms)} "
            f"| {_three(t.limit_p50_ms, t.limit_p99_ms, t.limit_max_ms)} | {ratio:.1f} "
            f"| {t.skipped_tick_count} of {t.tick_count} | {t.cpu_percent:.2f} ({t.fit_cpu_percent:.2f}) "
            f"| {t.memory_mb:.0f} |"
        )
    return "\n".join(lines)


def scale_table(results: list[Ticks]) -> str:
    """Markdown: a line for each number of antennas."""
    lines = [
        f"| antennas on {os.cpu_count()} cores | skipped of ticks | late 50 / 99 % / max, ms "
        "| processor of all, % of a core | of one | simulated ACUs, apart, % | memory of one, MB |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {t.antennas} | {t.skipped_tick_count} of {t.tick_count} | {_three(t.p50_ms, t.p99_ms, t.max_ms)} "
        f"| {t.cpu_percent:.1f} | {t.cpu_percent / t.antennas:.2f} | {t.acu_cpu_percent:.1f} | {t.memory_mb:.0f} |"
        for t in results
    ]
    return "\n".join(lines)


def asked_table(results: list[Ticks]) -> str:
    """Markdown: asked and measured."""
    lines = ["| what | asked | measured | |", "|---|---|---|---|"]
    for name, result, asked, is_met in asked_rows(results):
        measured = asked.value(result)
        lines.append(f"| {name} | <= {asked.most:g} | {measured:.2f} | {'met' if is_met else 'NOT MET'} |")
    return "\n".join(lines)


def _three(*values_ms: float) -> str:
    return " / ".join(f"{value:.2f}" for value in values_ms)


def plot(path: Path, results: list[Ticks]) -> None:
    """Draw 50 %, 99 % and the greatest lateness of each condition, the machine's limit as a mark."""
    from matplotlib.figure import Figure  # slow to load

    figure = Figure(figsize=(1.8 * len(results) + 3.0, 4.0), dpi=120, layout="constrained")
    axes = figure.subplots()
    figures = (("50 %", "p50_ms"), ("99 %", "p99_ms"), ("max", "max_ms"))
    for k, (label, name) in enumerate(figures):
        places = [i + 0.27 * (k - 1) for i in range(len(results))]
        axes.bar(places, [getattr(t, name) for t in results], 0.25, color=COLOURS[k], label=label)
        axes.scatter(places, [getattr(t, f"limit_{name}") for t in results], color="black", marker="_", s=200, zorder=3)
    axes.set_yscale("log")
    axes.set_ylabel(f"tick late, ms (line: {results[0].limit_name})")
    axes.set_xticks(
        range(len(results)), [t.condition if t.antennas == 1 else f"{t.antennas} antennas" for t in results]
    )
    axes.grid(alpha=0.3, axis="y")
    axes.legend(frameon=False)
    figure.savefig(path)


def main() -> int:
    """Run the bench as the command line asks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=SECONDS, metavar="N", help="of each run; default: 600")
    parser.add_argument("--only", choices=CONDITIONS, action="append", help="this condition; may be given again")
    parser.add_argument("--antennas", type=int, nargs="+", metavar="N", help="so many daemons at once, idle")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures here")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="also draw them here, as PNG")
    options = parser.parse_args()
    if not SHORTEST_S <= options.seconds <= LONGEST_S:
        parser.error(
            f"--seconds {options.seconds:g}: expected {SHORTEST_S:g} to {LONGEST_S:g}, a pass's length at most"
        )
    runs = [(CONDITIONS[name], 1) for name in options.only or CONDITIONS]
    if options.antennas:
        if min(options.antennas) < 1:
            parser.error("--antennas: expected 1 or more")
        runs = [(Condition("idle"), number) for number in options.antennas]
    results: list[Ticks] = []
    try:
        for number, (condition, antennas) in enumerate(runs):
            with tempfile.TemporaryDirectory(prefix="acu-daemon-tick-") as temporary:
                where = Path(temporary) / str(number)
                results.append(run_condition(where, condition, antennas, options.seconds, _say))
    except (BenchError, AcuDaemonError, OSError) as error:
        print(f"bench_tick: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    print("\n" + (scale_table(results) if options.antennas else conditions_table(results)))
    if asked_rows(results):
        print("\n" + asked_table(results))
    if options.json is not None:
        options.json.write_text(json.dumps([asdict(result) for result in results], indent=1) + "\n")
    if options.plot is not None:
        plot(options.plot, results)
    return 0 if all(is_met for *_, is_met in asked_rows(results)) else 1


def _say(text: str) -> None:
    print(text, flush=True)


if __name__ == "__main__":
    sys.exit(main())

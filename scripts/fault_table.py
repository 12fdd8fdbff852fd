#!/usr/bin/env python3
"""Prints the measured columns of docs/reliability.md: one short flight in virtual time for every fault.

scripts/fault_table.py            all          scripts/fault_table.py unplug nak          these
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from fault_flights import CASES, Measured, measure

NOT_SHOWN = {"IDLE", "PREPOSITION"}  # on the way back
SAID = ("acu.doubted", "acu.nak", "acu.faults", "disarmed", "axis.latched", "encoder.frozen", "clock.stepped")
SAID += ("link.poor", "link.lost")
HEADER = ("fault", "shows", "log", "beam off (deg)", "back after (s)", "then (deg)", "outside / burst / stale")


def main() -> None:
    """Fly and print as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help="default: all")
    names = parser.parse_args().cases or list(CASES)
    if unknown := [name for name in names if name not in CASES]:
        parser.error(f"there is no case {unknown[0]!r}; there are: {', '.join(CASES)}")
    print("SIMULATION, virtual time")
    print(f"| {' | '.join(HEADER)} |\n|{'---|' * len(HEADER)}")
    total = 0
    for name in names:
        seen = measure(name)
        total += seen.outside_count + seen.burst_count + seen.stale_count
        print(f"| {' | '.join(cells(name, seen))} |", flush=True)
    print(f"\n{len(names)} flights; commands outside the envelope, in a burst or stale: {total}")


def cells(name: str, seen: Measured) -> tuple[str, ...]:
    """One line of the table."""
    case = CASES[name]
    shown = [state for state in dict.fromkeys(seen.states) if state in case.shows and state not in NOT_SHOWN]
    said = [event for event in SAID if event in seen.events]
    return (
        name,
        ", ".join(shown[:1]),
        ", ".join(said),
        f"{seen.worst_deg:.2f}",
        f"{seen.recovered_s:.1f}",
        f"{seen.after_deg:.2f}",
        f"{seen.outside_count} / {seen.burst_count} / {seen.stale_count}",
    )


if __name__ == "__main__":
    main()

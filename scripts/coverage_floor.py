#!/usr/bin/env python3
"""Prints how much of each room the tests reach, lines and branches; exit status 1 below the floor.

The floor counts where the folder of real passes is beside the checkout: without it some tests skip.
scripts/coverage_floor.py build/coverage.json [more ...]     files of `python -m slipcover --json`, taken together
"""

import json
import sys
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

FLOOR_PERCENT = {"lines": 95.2, "branches": 88.7}  # half a point below what was measured: raise it, never lower it
PARTS = tuple(FLOOR_PERCENT)
REAL_PASSES = Path(__file__).resolve().parents[2] / "shared" / "data"


@dataclass
class Reached:
    """What of a file, a room or all was run.  Owned by whoever counts."""

    run: dict[str, set[Any]] = field(default_factory=lambda: {part: set() for part in PARTS})
    known: dict[str, set[Any]] = field(default_factory=lambda: {part: set() for part in PARTS})

    def percent(self, part: str) -> float:
        return 100.0 * len(self.run[part]) / len(self.known[part]) if self.known[part] else 100.0


def read(paths: Iterable[Path]) -> dict[str, Reached]:
    """What was reached by room; the room "" is all of them."""
    rooms: dict[str, Reached] = defaultdict(Reached)
    for path in paths:
        for name, seen in json.loads(path.read_text(encoding="utf-8"))["files"].items():
            parts = Path(name).parts
            room = parts[parts.index("acu_daemon") + 1].removesuffix(".py")
            for part in PARTS:
                run = {(name, str(one)) for one in seen[f"executed_{part}"]}
                missed = {(name, str(one)) for one in seen[f"missing_{part}"]}
                for reached in (rooms[room], rooms[""]):
                    reached.run[part] |= run
                    reached.known[part] |= run | missed
    return dict(rooms)


def main(arguments: list[str]) -> int:
    """Print the table; 1 where a part is below its floor."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print(__doc__)
        return 2
    rooms = read(map(Path, arguments))
    print(f"{'':14}{'lines':>8}{'branches':>10}   percent reached")
    for room in [*sorted(rooms.keys() - {""}), ""]:
        print(f"{room or 'all':14}{rooms[room].percent('lines'):8.1f}{rooms[room].percent('branches'):10.1f}")
    fallen = below_floor(rooms[""])
    for line in fallen:
        print(line)
    return 1 if fallen and REAL_PASSES.is_dir() else 0


def below_floor(reached: Reached) -> list[str]:
    """A line for each part that is below its floor."""
    return [
        f"{part}: {reached.percent(part):.1f} % is below the floor of {floor:g} %: test what is new"
        for part, floor in FLOOR_PERCENT.items()
        if reached.percent(part) < floor
    ]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

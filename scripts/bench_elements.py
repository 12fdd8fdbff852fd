#!/usr/bin/env python3
"""How long the elements of two satellites take out of one file of 16,000 sets: TLE, and the same as JSON and CSV.

    .venv/bin/python scripts/bench_elements.py                    the catalogue of ../shared/data/tle_sets
    .venv/bin/python scripts/bench_elements.py FILE --satellites 25544 41335

Medians of five, processor time: both satellites from the file's bytes to propagators with their checks, as `run` and
`check` load them, beside what the parsing of every set alone takes.  Asked are 0.5 s.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from tables.console import say

from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.edge import elements_file
from acu_daemon.edge.elements_store import record_of
from acu_daemon.edge.orbit_file import SET_PARSERS, read_orbit_file
from acu_daemon.errors import AcuDaemonError
from acu_daemon.orbit.element_set import ElementSet

CATALOGUE = Path(__file__).resolve().parents[2] / "shared/data/tle_sets/celestrak_active_2026-08-18.3le.gz"
ASKED_S, RUNS = 0.5, 5


def seconds(work: Callable[[], object]) -> float:
    """Processor time, median."""
    taken = []
    for _ in range(RUNS):
        begin = time.process_time()
        work()
        taken.append(time.process_time() - begin)
    return median(taken)


def load(path: Path, kind: str, numbers: list[int], now_tai_s: float) -> None:
    for number in numbers:
        satellite = SatelliteFile.model_validate(
            {"satellite": {"name": "x", "norad_id": number}, "elements": {"kind": kind, "file": path.name}}
        )
        elements_file.load_elements(satellite, path.parent / "x.toml", now_tai_s)


def written(sets: list[ElementSet], folder: Path) -> dict[str, Path]:
    """The sets as JSON and CSV."""
    records = [record_of(one, "x") for one in sets]
    (folder / "all.json").write_text(json.dumps(records))
    keys = [key for key in records[0] if key != "COMMENT"]
    lines = [",".join(str(one[key]).replace(",", " ") for key in keys) for one in records]
    (folder / "all.csv").write_text("\n".join([",".join(keys), *lines, ""]))
    return {"JSON": folder / "all.json", "CSV": folder / "all.csv"}


def main() -> int:
    """Print the table.  Exit status: 0; 1 slower than asked; 2 wrong use."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", type=Path, default=CATALOGUE, metavar="FILE")
    parser.add_argument("--satellites", type=int, nargs="+", default=[25544, 41335], metavar="NUMBER")
    asked = parser.parse_args()
    try:
        kind, text = read_orbit_file(asked.file)
        sets, _ = SET_PARSERS[kind](text, str(asked.file))
    except (AcuDaemonError, OSError, KeyError) as error:
        parser.error(f"{asked.file}: {error}")
    mine = [one for one in sets if one.norad_id in asked.satellites]
    if len({one.norad_id for one in mine}) < len(asked.satellites):
        parser.error(f"{asked.file} does not hold {asked.satellites}")
    now_tai_s = mine[0].epoch_tai_s
    worst_s = 0.0
    with tempfile.TemporaryDirectory() as folder:
        files = {kind.upper(): asked.file, **written(sets, Path(folder))}
        for name, path in files.items():
            form = "tle" if name == "TLE" else "omm"
            named_s = seconds(lambda path=path, form=form: load(path, form, asked.satellites, now_tai_s))  # type: ignore[misc]
            whole = read_orbit_file(path)[1]
            whole_s = seconds(lambda whole=whole, form=form: SET_PARSERS[form](whole, "x"))  # type: ignore[misc]
            count = f"{len(sets)} sets, {len(asked.satellites)} named"
            say(f"{name}: {count}: {named_s:.3f} s; all parsed once: {whole_s:.2f} s")
            worst_s = max(worst_s, named_s)
    say(f"asked: {ASKED_S} s")
    return 0 if worst_s <= ASKED_S else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Records what the decision of a tick, the estimation of a pass and the whole daemon do in runs full of troubles.

tests/test_decisions.py, tests/test_recorded_fits.py and tests/test_tapes.py compare.  After a change that is meant:
run this, and read the difference.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import fault_tapes
import recorded_decisions
import recorded_fits
from test_mirrors import SEEDS, run_of


def main() -> None:
    """Write all records."""
    decisions = {str(seed): recorded_decisions.lines(*run_of(seed)) for seed in SEEDS}
    fits = {name: recorded_fits.lines(name) for name in recorded_fits.RUNS}
    for module, runs in ((recorded_decisions, decisions), (recorded_fits, fits)):
        text = module.NOTE + "".join(f"run {name}\n" + "\n".join(lines) + "\n" for name, lines in runs.items())
        module.RECORDED.write_text(text)
        print(f"{module.RECORDED.name}: {text.count(chr(10))} lines")
    for name in fault_tapes.TROUBLES:
        path = fault_tapes.record(name)
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()

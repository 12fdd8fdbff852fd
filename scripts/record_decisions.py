#!/usr/bin/env python
"""Records what the decision of a tick does in the runs of tests/troubled_decision.py, for tests/test_decisions.py."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from recorded_decisions import NOTE, RECORDED, lines
from test_mirrors import SEEDS, run_of


def main() -> None:
    text = NOTE + "".join(f"run {seed}\n" + "\n".join(lines(*run_of(seed))) + "\n" for seed in SEEDS)
    RECORDED.write_text(text)
    print(f"{RECORDED.name}: {text.count(chr(10))} lines")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Looks for a sequence of troubles that breaks a promise of the daemon (P1 to P10), for as long as is asked.

scripts/promises.py --examples 500 --seed 7        the state machine of tests/test_promises.py, other sequences
"""

import argparse
import sys
import time
from pathlib import Path

from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from test_promises import Promises

ALL_PHASES = (Phase.generate, Phase.shrink)


def main() -> None:
    """Run; a sequence that breaks a promise is shrunk and printed, and the exit status is 1."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--examples", type=int, default=100, metavar="N", help="sequences (default %(default)s)")
    parser.add_argument("--steps", type=int, default=30, metavar="N", help="longest sequence (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="another seed, other sequences")
    parser.add_argument("--no-shrink", action="store_true", help="print the first sequence found as it is")
    options = parser.parse_args()
    print(f"SIMULATION, virtual time: {options.examples} sequences of at most {options.steps} troubles")
    chosen = settings(
        max_examples=options.examples,
        stateful_step_count=options.steps,
        phases=ALL_PHASES[:1] if options.no_shrink else ALL_PHASES,
        deadline=None,
        database=None,
        print_blob=False,
        suppress_health_check=list(HealthCheck),
    )
    begun_s = time.process_time()
    try:
        run_state_machine_as_test(seed(options.seed)(Promises), settings=chosen)
    except AssertionError as error:
        print(f"a promise is broken: {error}\n{chr(10).join(getattr(error, '__notes__', []))}")
        sys.exit(1)
    print(f"every promise held; {time.process_time() - begun_s:.0f} s of processor time")


if __name__ == "__main__":
    main()

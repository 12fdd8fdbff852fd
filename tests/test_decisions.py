"""The decision of every tick of two dozen troubled runs is what it was when it was recorded."""

from functools import cache

import pytest
from recorded_decisions import RECORDED, lines
from test_mirrors import SEEDS, run_of

from acu_daemon.drivers.sa3842.angles import LSB_DEG

pytestmark = pytest.mark.long

TOLERANCE_DEG = 1.5 * LSB_DEG  # a rounding that falls on the other side


@cache
def recorded() -> dict[int, list[str]]:
    """Lines by run."""
    runs: dict[int, list[str]] = {}
    for line in RECORDED.read_text().splitlines()[1:]:
        if line.startswith("run "):
            runs[int(line[4:])] = []
        else:
            runs[max(runs)].append(line)
    return runs


def is_same(now: str, then: str) -> bool:
    """Registers within a code; all else to the letter."""
    if " registers " not in now or " registers " not in then:
        return now == then
    (tick, _, *here), (tick_then, _, *there) = now.split(), then.split()
    return tick == tick_then and all(
        abs(float(one) - float(other)) < TOLERANCE_DEG for one, other in zip(here, there, strict=True)
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_what_a_tick_decides_is_as_recorded_or_the_record_is_made_anew_on_purpose(seed: int) -> None:
    found, then = list(lines(*run_of(seed))), recorded()[seed]
    for here, there in zip(found, then, strict=False):
        assert is_same(here, there), "meant?  then: scripts/record.py, and read the difference"
    assert len(found) == len(then)

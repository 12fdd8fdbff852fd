"""What the estimation of a pass makes of troubled readings is what it was when it was recorded."""

from functools import cache

import pytest
from recorded_fits import RECORDED, RUNS, lines

pytestmark = pytest.mark.long

SHARE, LEAST = 0.003, 1e-9  # by which figures may differ from machine to machine


@cache
def recorded() -> dict[str, list[str]]:
    """Lines by run."""
    runs: dict[str, list[str]] = {}
    for line in RECORDED.read_text().splitlines()[1:]:
        if line.startswith("run "):
            runs[line[4:]] = []
        else:
            next(reversed(runs.values())).append(line)
    return runs


@pytest.mark.parametrize("name", RUNS)
def test_what_is_fitted_to_a_pass_is_as_recorded_or_the_record_is_made_anew_on_purpose(name: str) -> None:
    assert len(lines(name)) == len(recorded()[name])
    for found, then in zip(lines(name), recorded()[name], strict=True):
        (words, _, figures), (words_then, _, figures_then) = found.partition(" | "), then.partition(" | ")
        assert words == words_then, "meant?  then: scripts/record.py, and read the difference"
        expected = [float(one) for one in figures_then.split()]
        assert [float(one) for one in figures.split()] == pytest.approx(expected, rel=SHARE, abs=LEAST)

"""Estimators side by side: which readings are compared, and what the table says."""

import numpy as np
import pytest

from acu_daemon.assist.session.estimator_comparison import Comparison, compare
from acu_daemon.assist.session.replay_readings import Replayed
from acu_daemon.model import Correction, FitResult, Reading
from acu_daemon.report.comparison_table import table, what_is_compared

FIT = FitResult("one", Correction(), 0.0, 10, 0, 0.0, along_s=-1.25, across_deg=0.01)


def lines(flags: str) -> list[tuple[float, Reading | None]]:
    """A line a second: L locked, u not, with angles; - without angles.  The antenna shows azimuth 100, elevation 30."""
    return [
        (float(k), None if flag == "-" else Reading(float(k), 100.0, 30.0, flag == "L")) for k, flag in enumerate(flags)
    ]


def predicted(count: int, first_fit: int, off_deg: float) -> list[Replayed]:
    """Predictions that are wrong by off_deg in elevation, fitted from a line on."""
    return [
        Replayed(
            100.0,
            30.0 + off_deg,
            None,
            True,
            False,
            True,
            *((FIT, {"side lobe": 1, "off the predicted path": 3}) if k >= first_fit else ()),
        )
        for k in range(count)
    ]


def compared(flags: str, **first_fits: int) -> Comparison:
    results = {name: predicted(len(flags), first, 0.1) for name, first in first_fits.items()}
    return compare(lines(flags), results, lock_dwell_s=1.0)


@pytest.mark.parametrize(
    ("flags", "at", "is_held_back"),
    [
        ("uuLLLLuu", [6, 7], True),  # what came before the first lock is the antenna's own way
        ("LLLL-u-u", [5, 7], True),
        ("LLLLuLLu", [4, 7], True),  # acquired but not for the dwell is neither
        ("LLLL--", [2, 3], False),
        ("LLLLLL", [2, 3, 4, 5], False),
        ("uuu---", [], False),
    ],
)
def test_readings_without_lock_after_the_first_lock_are_compared_else_locked_ones(
    flags: str, at: list[int], is_held_back: bool
) -> None:
    seen = compared(flags, one=2)
    assert seen.errors["one"].tai_s.tolist() == at
    assert seen.is_held_back == is_held_back
    assert seen.errors["one"].error_deg == pytest.approx([0.1] * len(at))


def test_all_are_compared_where_all_that_ever_fit_have_fitted() -> None:
    seen = compared("LLLLLLLL", early=1, late=5, never=99)
    assert {name: errors.tai_s.tolist() for name, errors in seen.errors.items()} == {
        "early": [5, 6, 7],
        "late": [5, 6, 7],
        "never": [5, 6, 7],
    }
    assert [fit is None for fit in seen.last_fit.values()] == [False, False, True]


def test_the_table_says_what_was_compared_and_how_far_off_the_last_fit_was() -> None:
    said = table(compared("LLLLuu", one=2, none=99), {"one": 1.234, "none": 0.1})
    assert said[0].startswith("Prediction against 2 readings without lock")
    assert said[3].split() == ["one", *["0.1000"] * 3, "1.250", "s", "early,", "+0.0100", "deg", "across", "1.23"]
    assert said[4].split()[-2:] == ["none", "0.10"]
    assert said[5:7] == ["", "readings left out of the fits"]
    assert said[7:] == ["one             3 off the predicted path, 1 side lobe", "none            none"]


def test_without_anything_to_compare_the_table_has_dashes() -> None:
    seen = compared("uu--", one=99)
    assert what_is_compared(seen) == "Nothing to compare: no reading with angles after the first fit."
    assert table(seen, {"one": 0.0})[3].split()[:4] == ["one", "-", "-", "-"]
    assert seen.errors["one"].error_deg.shape == np.empty(0).shape


def moving(flags: str, moves: str) -> Comparison:
    """The path moves by 0.3 deg a second; the antenna with it (f), not at all (s), or back (b), from line to line."""
    results = [
        Replayed(100.0 + 0.3 * k, 0.1, None, True, False, True, *((FIT,) if k >= 1 else ())) for k in range(len(flags))
    ]
    az_deg, rows = 100.0, []
    for k, (flag, move) in enumerate(zip(flags, moves, strict=True)):
        rows.append((float(k), Reading(float(k), az_deg, 0.0, flag == "L")))
        az_deg += {"f": 0.3, "s": 0.0, "b": -0.6}[move]
    return compare(rows, {"one": results}, lock_dwell_s=1.0)


@pytest.mark.parametrize("away", ["s", "b"])
def test_an_antenna_that_stands_still_or_moves_unlike_the_path_is_not_compared(away: str) -> None:
    seen = moving("LLLL" + 60 * "u", 34 * "f" + 30 * away)
    assert seen.stray_count + seen.line_count == 60
    assert seen.line_count == pytest.approx(30, abs=3)
    assert seen.errors["one"].error_deg.max() < 1.0
    [(begin_s, end_s)] = seen.strays_tai_s
    assert (begin_s, end_s) == (pytest.approx(34.0, abs=3.0), 63.0)
    assert f"Not compared: {seen.stray_count} without lock while the antenna stood" in what_is_compared(seen)


def test_a_stop_right_at_the_loss_leaves_the_locked_readings_to_compare() -> None:
    seen = moving("LLLLLL" + 30 * "u", 5 * "f" + 31 * "s")
    assert not seen.is_held_back
    assert seen.stray_count == 30
    assert seen.errors["one"].tai_s.max() == 5.0


def test_an_antenna_that_follows_beside_the_path_is_compared_whatever_its_offset() -> None:
    seen = moving("LLLL" + 30 * "u", 34 * "f")
    assert (seen.stray_count, seen.line_count) == (0, 30)

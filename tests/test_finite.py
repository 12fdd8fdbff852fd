"""control.safety.finite: which numbers are taken, at the limit and on either side, and what is left out whole."""

from dataclasses import replace
from math import inf, nan, nextafter
from typing import Any

import pytest
from test_tick import CONFIG, NOW, PLAN, path, saw, status

from acu_daemon.control.safety.finite import MOST_S, finite_only, is_fit, is_plan
from acu_daemon.control.tick_input import Observation, Request, Sky, TickInput
from acu_daemon.model import MOST_DEG, Correction, FitResult

FIT = FitResult("full", Correction(), NOW - 5.0, 40, 0, 0.02, 0.5, 0.01)
SKY = Sky(path(), FIT, PLAN)
SEEN = saw(status(), silence_s=0.1, requests=(Request.ARM,))
GIVEN = TickInput(SEEN, SKY, NOW)


def numbers(most: float) -> list[tuple[float, bool]]:
    """Numbers, and whether they are taken."""
    good = [0.0, most, -most, nextafter(most, 0.0)]
    bad = [nextafter(most, inf), -nextafter(most, inf), inf, -inf, nan]
    return [(one, True) for one in good] + [(one, False) for one in bad]


DEGREES = pytest.mark.parametrize(("value", "is_good"), numbers(MOST_DEG))
SECONDS = pytest.mark.parametrize(("value", "is_good"), numbers(MOST_S))
assert (MOST_DEG, MOST_S) == (1e5, 1e12)


def refused(given: TickInput) -> str:
    """What is left out is all that is left out."""
    taken, names = finite_only(given)
    bad = names.split(", ") if names else []
    seen = replace(given.seen, status=None, reading=None) if "status" in bad else given.seen
    sky = Sky(*(None if name in bad else getattr(given.sky, name) for name in ("prediction", "fit", "plan")))
    assert taken == replace(given, seen=seen, sky=sky)
    assert (taken is given) is (not bad)
    return names


def test_an_input_of_numbers_or_of_nothing_is_taken_as_it_is() -> None:
    assert refused(GIVEN) == ""
    assert refused(TickInput(Observation(), Sky(), NOW)) == ""


@DEGREES
@pytest.mark.parametrize("name", ["az_deg", "el_deg"])
@pytest.mark.parametrize("of", ["status", "reading", "both"])
def test_a_status_or_a_reading_without_an_angle_leaves_out_both(
    of: str, name: str, value: float, is_good: bool
) -> None:
    seen = SEEN
    if of != "reading":
        seen = replace(seen, status=replace(seen.status, **{name: value}))
    if of != "status":
        seen = replace(seen, reading=replace(seen.reading, **{name: value}))
    assert refused(replace(GIVEN, seen=seen)) == ("" if is_good else "status")
    alone = replace(seen, **{"status": {"reading": None}, "reading": {"status": None}, "both": {}}[of])
    assert refused(replace(GIVEN, seen=alone)) == ("" if is_good else "status")


@SECONDS
def test_a_reading_without_a_time_is_left_out(value: float, is_good: bool) -> None:
    seen = replace(SEEN, reading=replace(SEEN.reading, tai_s=value))
    assert refused(replace(GIVEN, seen=seen)) == ("" if is_good else "status")


@pytest.mark.parametrize(("silence_s", "taken_s"), [(nan, inf), (inf, inf), (0.3, 0.3)])
@pytest.mark.parametrize("is_bad", [False, True])
def test_a_silence_that_is_no_number_is_a_lost_link_and_is_not_told(
    silence_s: float, taken_s: float, is_bad: bool
) -> None:
    seen = replace(SEEN, silence_s=silence_s)
    seen = replace(seen, status=replace(status(), az_deg=nan)) if is_bad else seen
    taken, names = finite_only(replace(GIVEN, seen=seen))
    assert (taken.seen.silence_s, names) == (taken_s, "status" if is_bad else "")
    assert taken.seen.silence_s > CONFIG.acu.silence_s or silence_s == 0.3
    assert (taken.seen.status is None, taken.seen.requests) == (is_bad, (Request.ARM,))


@pytest.mark.parametrize(
    ("start_s", "step_s", "is_good"),
    [
        (MOST_S - 909.0, 1.0, True),
        (MOST_S - 908.0, 1.0, False),
        (-MOST_S, 1.0, True),
        (-MOST_S - 1.0, 1.0, False),
        (nan, 1.0, False),
        (-inf, 1.0, False),
        (NOW, inf, False),
        (NOW, 0.0, False),
        (NOW, 1e-9, True),
        (NOW, -0.1, False),
        (NOW, nan, False),
    ],
)
def test_a_prediction_begins_and_ends_at_a_time_and_goes_forward(start_s: float, step_s: float, is_good: bool) -> None:
    one = replace(path(), start_tai_s=start_s, step_s=step_s)
    assert one.az_deg.size == 910
    assert refused(replace(GIVEN, sky=replace(SKY, prediction=one))) == ("" if is_good else "prediction")


@pytest.mark.parametrize(
    ("name", "value", "is_good"),
    [
        *((name, *one) for name in ("along_s", "at_tai_s") for one in numbers(MOST_S)),
        *(("across_deg", *one) for one in numbers(MOST_DEG)),
        ("residual_rms_deg", nan, True),  # no decision reads it
    ],
)
def test_a_fit_has_numbers_along_across_and_of_its_time(name: str, value: float, is_good: bool) -> None:
    fit = replace(FIT, **{name: value})
    assert is_fit(fit) is is_good
    assert refused(replace(GIVEN, sky=replace(SKY, fit=fit))) == ("" if is_good else "fit")


@pytest.mark.parametrize(
    ("name", "value", "is_good"),
    [
        *((name, *one) for name in ("rise_tai_s", "set_tai_s", "start_tai_s") for one in numbers(MOST_S)),
        *((name, *one) for name in ("start_az_deg", "start_el_deg") for one in numbers(MOST_DEG)),
    ],
)
def test_a_plan_has_three_times_and_two_angles(name: str, value: float, is_good: bool) -> None:
    plan = replace(PLAN, **{name: value})
    assert is_plan(plan) is is_good
    assert refused(replace(GIVEN, sky=replace(SKY, plan=plan))) == ("" if is_good else "plan")


def test_all_that_is_left_out_is_named_in_turn() -> None:
    seen = replace(SEEN, reading=replace(SEEN.reading, el_deg=nan))
    sky: dict[str, Any] = {
        "prediction": replace(path(), step_s=0.0),
        "fit": replace(FIT, along_s=nan),
        "plan": replace(PLAN, set_tai_s=inf),
    }
    assert refused(TickInput(seen, Sky(**sky), NOW)) == "status, prediction, fit, plan"
    assert refused(TickInput(SEEN, Sky(**sky), NOW)) == "prediction, fit, plan"
    assert refused(TickInput(seen, SKY, NOW)) == "status"

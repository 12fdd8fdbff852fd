"""Whether elements that come while a pass is waited for are taken for it, each reason by itself."""

from math import nan
from types import SimpleNamespace
from typing import Any

import pytest

from acu_daemon.cli.elements_watch import why_worse
from acu_daemon.model import Pass

COMING = Pass(1000.0, 1300.0, 1600.0, 10.0, 60.0, 90.0, 170.0)


def target(epoch_tai_s: float, kind: str = "tle", spans: Any = None, **uncertainty: float | None) -> Any:
    """Elements of a kind, and how exact the file says that they are; spans: of an ephemeris."""
    source = SimpleNamespace(kind=kind, epoch_tai_s=epoch_tai_s)
    if spans is not None:
        source.spans_tai_s = spans
    elements = SimpleNamespace(propagator=source, epoch_tai_s=epoch_tai_s, expected_m=nan, file="a.tle")
    known = SimpleNamespace(position_km=uncertainty.get("km"), velocity_m_s=uncertainty.get("m_s"))
    return SimpleNamespace(elements=elements, satellite=SimpleNamespace(uncertainty=known))


@pytest.mark.parametrize(
    ("spans", "is_taken"),
    [
        (((1000.0, 1600.0),), True),
        (((0.0, 5000.0),), True),
        (((1000.1, 1600.0),), False),
        (((1000.0, 1599.9),), False),
        (((0.0, 1300.0), (1300.1, 5000.0)), False),
        (((-50.0, -10.0), (1000.0, 1600.0)), True),
    ],
)
def test_an_ephemeris_is_taken_where_one_of_its_spans_has_the_whole_pass(spans: Any, is_taken: bool) -> None:
    said = why_worse(target(900.0), target(0.0, "oem", spans), COMING)
    assert said == ("" if is_taken else "the new ephemeris does not cover the coming pass")


@pytest.mark.parametrize(
    ("old_s", "new_s", "reason"),
    [
        (500.0, 500.0, ""),
        (500.0, 499.9, "older"),
        (500.0, 1500.0, ""),
        (500.0, 1500.1, "further from the coming pass"),
        (1200.0, 1100.0, "older"),
    ],
)
def test_elements_are_taken_that_are_no_older_and_as_near_to_the_rise(old_s: float, new_s: float, reason: str) -> None:
    said = why_worse(target(old_s), target(new_s), COMING)
    assert reason in said
    assert bool(said) == bool(reason)


def test_elements_in_place_of_an_ephemeris_may_be_older_and_further() -> None:
    assert why_worse(target(900.0, "oem", ((0.0, 2000.0),)), target(-1e6), COMING) == ""


@pytest.mark.parametrize(("key", "name"), [("km", "position_km"), ("m_s", "velocity_m_s")])
@pytest.mark.parametrize(
    ("old", "new", "is_taken"), [(1.0, 1.0, True), (1.0, 1.1, False), (1.0, 0.9, True), (None, 9.0, True)]
)
def test_elements_that_are_said_to_be_less_exact_are_not_taken(
    key: str, name: str, old: float | None, new: float | None, is_taken: bool
) -> None:
    said = why_worse(target(500.0, **{key: old}), target(500.0, **{key: new}), COMING)
    assert said == (
        "" if is_taken else f"the new ones are expected to be less exact: {name} = {new:g} in place of {old:g}"
    )

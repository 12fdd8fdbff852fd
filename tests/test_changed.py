"""`changed` gives what `dataclasses.replace` gives."""

from dataclasses import fields, replace
from typing import Any

import pytest

from acu_daemon.control.changed import changed
from acu_daemon.control.state import ControlState


@pytest.mark.parametrize("name", [item.name for item in fields(ControlState)])
def test_every_field_can_be_changed_as_replace_does_and_the_old_memory_stays(name: str) -> None:
    before = replace(ControlState(), az_deg=12.0, latch="azimuth")
    value: dict[str, Any] = {name: object()}
    after = changed(before, **value)
    assert after == replace(before, **value) != before
    assert before == replace(ControlState(), az_deg=12.0, latch="azimuth")
    assert hash(after) == hash(replace(before, **value))

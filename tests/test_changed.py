"""`changed` gives what `dataclasses.replace` gives."""

from dataclasses import fields, replace
from typing import Any

import pytest

from acu_daemon.control.changed import changed
from acu_daemon.control.safety.axis_watch import AxisWatch
from acu_daemon.control.state import ControlState, Latch
from acu_daemon.control.tick_input import Observation

MEMORIES = (ControlState(latch=Latch("azimuth")), Observation(silence_s=0.3), AxisWatch(side=1))


@pytest.mark.parametrize("before", MEMORIES, ids=lambda one: type(one).__name__)
def test_every_field_can_be_changed_as_replace_does_and_the_old_memory_stays(before: Any) -> None:
    kept = replace(before)
    for item in fields(before):
        value: dict[str, Any] = {item.name: object()}
        after = changed(before, **value)
        assert after == replace(before, **value) != before, item.name
        assert hash(after) == hash(replace(before, **value)), item.name
    assert before == kept

"""A line with bad replies is an alarm until it has had none for five seconds, also across connections."""

from types import SimpleNamespace
from typing import Any

import pytest
from structlog.testing import capture_logs

from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.line_watch import LineWatch


def looks(*garbled_counts: int | None) -> list[bool]:
    """Whether there is an alarm, second after second; a count is of its connection, None: the link is down."""
    port: Any = SimpleNamespace(is_up=True, failed_exchange_count=0, garbled_count=0, discarded_count=0, late_count=0)
    watch, alarms = LineWatch(port, CommonArea()), []
    for count in garbled_counts:
        port.is_up, port.garbled_count = count is not None, count or 0
        watch.look()
        alarms.append(bool(watch.alarm))
    return alarms


@pytest.mark.parametrize(
    ("garbled_counts", "alarms"),
    [
        ((0, 1, 2, 2, 2, 2, 2, 2), [False] * 8),
        ((0, 3, 3, 3, 3, 3, 3), [False, True, True, True, True, True, False]),
        ((0, 9, None, 0, 1), [False, True, False, False, False]),
        ((50, 59, None, 59, 62), [False, True, False, False, True]),
    ],
    ids=["one now and then", "three, then none", "a lost link", "another connection, that counts on"],
)
def test_bad_replies_are_an_alarm_until_there_were_none_for_five_seconds(
    garbled_counts: tuple[int | None, ...], alarms: list[bool]
) -> None:
    with capture_logs() as logs:
        assert looks(*garbled_counts) == alarms
    assert [log["event"] for log in logs].count("link.poor") == sum(
        now and not before for before, now in zip([False, *alarms], alarms, strict=False)
    )

"""When the angles of a status were sampled (docs/protocol.md, Time tags)."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from test_tick import CONFIG, NOW, status

from acu_daemon.acu.commands import Poll
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.foreground import Foreground
from acu_daemon.daemon.port import Answer
from acu_daemon.drivers.sa3842.messages import Command, WriteAndPoll
from acu_daemon.model import Reading

AT_9600 = replace(CONFIG, sample_delay_s=0.0277, poll_sample_delay_s=0.0152)  # 17 and 5 bytes, and 10 ms
TAI_S = 1e-6


@pytest.mark.parametrize(
    ("command", "first_byte_s", "sampled_s"),
    [
        (WriteAndPoll(100.0, 40.0), None, 0.0277),
        (WriteAndPoll(100.0, 40.0), 0.040, 0.0277),
        (WriteAndPoll(100.0, 40.0), 0.021, 0.021),
        (Poll(), 0.040, 0.0152),
        (Poll(), 0.012, 0.012),
    ],
)
def test_a_reading_is_tagged_by_what_it_answers_and_never_after_its_first_byte(
    command: Command, first_byte_s: float | None, sampled_s: float
) -> None:
    readings: list[Reading] = []
    nobody: Any = SimpleNamespace()
    foreground = Foreground(CommonArea(), nobody, nobody, AT_9600, after_tick=lambda: None, on_reading=readings.append)
    seen = status()
    answer = Answer(seen, NOW, None if first_byte_s is None else NOW + first_byte_s)
    foreground._hear(command, answer)
    assert [reading.tai_s - NOW for reading in readings] == pytest.approx([sampled_s], abs=TAI_S)

"""Half an hour of a station with a kill, wind and a pause, judged as the week of scripts/station_week.py is."""

from pathlib import Path

import pytest
from script_modules import load
from test_station import START, configured
from test_station_stow import RISE, blows, says, watched

from acu_daemon.cli.virtual_station import KilledError, StationAccess, run_days
from acu_daemon.daemon import foreground
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import PassState

pytestmark = pytest.mark.long

week = load("station_week")
ENDS = START + 1500.0


def kill(_access: StationAccess) -> None:
    raise KilledError


def test_nothing_is_lost_and_what_is_not_tracked_has_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(foreground, "REST_S", 5.0)
    config, state = (
        configured(tmp_path / "config", watched(tmp_path, "max_age_s = 3600\nresume_after_s = 60\n")),
        tmp_path / "state",
    )
    state.mkdir()
    answers: list[str] = []
    begin = [(START + 150.0, blows(tmp_path, week.CALM)), (RISE + 70.0, kill)]
    killed = run_days(config, state, START + 150.0, ENDS, script=begin, keeps_rows=False)
    after = [
        (RISE + 500.0, blows(tmp_path, week.STRONG)),
        (RISE + 900.0, blows(tmp_path, week.CALM)),
        (RISE + 1000.0, says(f"pause until={utc_text(RISE + 1200.0, 0)}", answers)),
    ]
    days = run_days(config, state, RISE + 90.0, ENDS, script=after, keeps_rows=False, before=killed)
    with ScheduleFile(state, is_read_only=True) as file:
        book = [one for one in file.book(START) if one.set_tai_s < ENDS - 10.0]
        granted = {one.number for one in book if any(s == "planned" for _, s, _ in file.history(one.number))}
    assert week.faults(config, book, granted, START + 150.0, ENDS - 10.0) == []
    tracked = [one for one in book if one.state in (PassState.DONE, PassState.DEGRADED)]
    assert {one.number for one in tracked} == granted
    assert len(tracked) >= 1
    assert [one["by"] for one in days.named("stow.begins")] == ["wind"]
    assert days.named("writer.failed") == []

"""What counts troubles in a row, or since they were told, begins anew once there was none."""

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drained import drain
from made_orbits import circular, site
from structlog.testing import capture_logs
from test_daemon_events import climb, events_named
from test_latch_file import TEXT, NoonClock
from test_writer import PATIENT_S, stuck

from acu_daemon.assist.estimators.kalman import Estimate, FilterState, linearise, sweep
from acu_daemon.assist.reading_gate import OUTLIER
from acu_daemon.assist.session.refit import RefitReply, RefitRequest
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.edge import recording as recording_file
from acu_daemon.edge.arrivals import MAX_WAITING_BYTES, Arrivals
from acu_daemon.edge.fetch_policy import Came, FetchOutcome, FetchState, after
from acu_daemon.edge.fit import FitDiedError, FitFailedError, InlineFitRunner
from acu_daemon.edge.latch import LatchKeeper
from acu_daemon.edge.recording import RecordingWriter
from acu_daemon.edge.writer import Writer
from acu_daemon.model import Reading, Readings

NOW, EVERY_S = 8.4e8, 7200.0
DIES, FAILS, FITS = FitDiedError("dead"), FitFailedError("no fit"), None


class Scripted(InlineFitRunner):
    """Answers as the script says, then always."""

    script = (FITS, DIES, DIES, DIES, FITS, DIES, DIES, FAILS, DIES, DIES, DIES, FITS, DIES)

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.asked_s: list[float] = []

    async def refit(self, request: RefitRequest) -> RefitReply:
        self.asked_s.append(asyncio.get_running_loop().time())
        number = len(self.asked_s) - 1
        error = self.script[number] if number < len(self.script) else FITS
        if error is not None:
            raise error
        return await super().refit(request)


@pytest.mark.long
def test_p9_the_fit_process_rests_by_its_deaths_in_a_row_and_an_answer_of_any_kind_ends_the_row() -> None:
    made: list[Scripted] = []

    def make(*arguments: Any) -> Scripted:
        made.append(Scripted(*arguments))
        return made[-1]

    flight = climb(60.0, make_runner=make)
    pauses_s = [entry["pause_s"] for entry in events_named(flight, "fit.failed")]
    assert pauses_s == [0.0, 1.0, 2.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.0]
    troubled = [number for number, error in enumerate(Scripted.script) if error is not None]
    (runner,) = made
    for number, pause_s in zip(troubled, pauses_s, strict=True):
        assert runner.asked_s[number + 1] - runner.asked_s[number] >= pause_s - 1e-6


def test_p10_each_time_a_recording_goes_on_it_tells_what_was_lost_since_the_last_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    append = RecordingWriter._append
    is_full = False

    def fill(writer: RecordingWriter, text: str) -> None:
        if is_full:
            raise OSError(28, "No space left on device")
        append(writer, text)

    monkeypatch.setattr(recording_file.RecordingWriter, "_append", fill)
    with capture_logs() as logs, RecordingWriter(tmp_path / "x.csv") as recording:
        for tick in range(30):
            is_full = tick in (5, 6, 7, 20, 21)
            recording.add(Reading(100.0 + tick, 1.0, 2.0, True))
    assert [log.get("lost_count") for log in logs] == [None, 3, None, 2]


@pytest.mark.parametrize("good", [Came.GOOD, Came.UNCHANGED])
@pytest.mark.parametrize("bad", [Came.FAILED, Came.UNUSABLE])
def test_a_server_that_answered_well_in_between_is_asked_again_as_after_a_first_failure(good: Came, bad: Came) -> None:
    def pauses_s(script: list[Came]) -> list[float]:
        state, now, found = FetchState("http://x"), NOW, []
        for came in script:
            state = after(state, FetchOutcome(came, "" if came is good else "no"), now, EVERY_S)
            found.append(state.next_tai_s - now)
            assert bool(state.problem) is (came is bad)
            now = state.next_tai_s
        return found

    first, second, third = pauses_s([bad] * 3)
    assert first < second < third
    assert pauses_s([bad, bad, good, bad, good, good, bad, bad]) == [
        *(first, second, EVERY_S, first, EVERY_S, EVERY_S, first, second)
    ]


def test_each_time_a_queue_is_empty_again_it_tells_what_was_dropped_since_the_last_time() -> None:
    told: list[int] = []
    writer = Writer("test", limit=3, on_drained=told.append)
    for dropped_count in (4, 2):
        job = stuck(writer)
        assert [writer.put(lambda: None) for _ in range(3 + dropped_count)] == [True] * 3 + [False] * dropped_count
        job.go.set()
        while len(told) < (1 if dropped_count == 4 else 2):
            pass
    assert writer.close(PATIENT_S)
    assert told == [4, 2]
    assert writer.dropped_count == 6


def test_p6_a_latch_that_is_written_at_last_is_no_problem_any_more_and_a_new_one_is_told_anew(tmp_path: Path) -> None:
    directory, writer = tmp_path / "gone", Writer("files")
    keeper = LatchKeeper(directory, writer, "", NoonClock())

    def see(text: str) -> str:
        keeper.see(text)
        drain(writer)
        return keeper.problem

    with capture_logs() as logs:
        assert "No such file" in see(TEXT)
        directory.mkdir()
        assert see(TEXT) == ""
        for left in directory.iterdir():
            left.unlink()
        directory.rmdir()
        assert "No such file" in see("another")
    assert writer.close(PATIENT_S)
    assert [log["event"] for log in logs] == ["latch.not_saved", "latch.saved_again", "latch.not_saved"]


async def test_what_was_taken_all_at_once_makes_room_for_as_much_again() -> None:
    arrivals = Arrivals()
    for _ in range(3):
        chunks = [bytes([k]) * (MAX_WAITING_BYTES // 4) for k in range(4)]
        for chunk in chunks:
            arrivals.put(chunk, 1.0)
        assert arrivals.take_all() == b"".join(chunks)


def verdicts(off_deg: list[float]) -> tuple[list[bool], FilterState]:
    """Which of the readings, so far off a path that the filter is sure of, count as outliers."""
    source, where = circular(), site(4.0)
    tai_s = source.epoch_tai_s + 0.1 * np.arange(len(off_deg))
    line = linearise(source, 0.0, 0.0, tai_s, where)
    readings = Readings(tai_s, np.degrees(line.az) % 360.0, np.degrees(line.el) + np.array(off_deg))
    begun = FilterState(Estimate(0.0, 0.0, 1e-14, 0.0, 1e-14))
    after, reasons = sweep(begun, readings, line, EstimatorSettings(0.03, 0.03))
    return [reason == OUTLIER for reason in reasons], after


def test_only_outliers_in_a_row_shake_the_filter() -> None:
    wild, good = [3.0] * 19, [0.0]
    shaken, after = verdicts((wild + good) * 5)
    assert shaken == ([True] * 19 + [False]) * 5
    assert after.outlier_count == 0
    assert after.estimate.p_mm < 1e-9


def test_a_filter_that_was_shaken_counts_the_next_outliers_from_the_first() -> None:
    """Each twentieth in a row begins the covariance afresh, and the row with it."""
    _, after = verdicts([3.0] * 20)
    assert after.outlier_count == 0
    assert after.estimate.p_mm > 1e-6
    _, after = verdicts([60.0] * 47)
    assert after.outlier_count == 7

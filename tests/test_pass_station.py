"""The report of a station's pass: hooks however late they end, and the phantom pass beside what came."""

import asyncio
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fault_tapes import path_of
from structlog.testing import capture_logs
from test_pass_report import NUMBER, numbers_in, shown, times_and_words_left_out
from test_station import START, configured

from acu_daemon.cli.pass_course import PassCourse
from acu_daemon.cli.pass_record import read_record, record_path, write_record
from acu_daemon.cli.pass_reports import PassReports
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.cli.report_command import make_report
from acu_daemon.cli.virtual_station import StationAccess, run_days
from acu_daemon.control.phantom import LostSpan, PhantomPass
from acu_daemon.edge.hooks import Hook, HookResult, Hooks
from acu_daemon.edge.kept_tapes import messages_beside
from acu_daemon.edge.tape_file import SUFFIX, TapeFile
from acu_daemon.edge.writer import Writer
from acu_daemon.schedule.book import PassState

AFTER = {"hook": "after_pass", "status": 0, "lasted_s": 2.5, "problem": "", "said": "sent <all>"}


def recorded(tmp_path: Path, **more: Any) -> Path:
    """A recording with what a station knows of its pass."""
    tape = Path(shutil.copy(path_of("receiver-fault"), tmp_path))
    coming = replay_pass(tape).taped.job.coming
    assert coming is not None
    start_tai_s = coming.rise_tai_s + 4.0
    lost = LostSpan(start_tai_s, start_tai_s + 3.0, "the azimuth drive <cannot> follow over the zenith")
    phantom = PhantomPass(17.96, 14.96, 0.1234567, (lost,), ("the cable is unwound by 360 deg at 12:00:00",), ("x: 7",))
    known = {"state": "done", "reason": "signal for 11 of 12 useful seconds", "locked_s": 11.0, "hooks": [AFTER]}
    write_record(tape, known | {"phantom": phantom.record, "running_hooks": ["during_pass"]} | more)
    return tape


def reported(tape: Path, folder: Path) -> tuple[dict[str, Any], str]:
    name = tape.name.removesuffix(SUFFIX)
    make_report(tape, folder)
    return json.loads((folder / f"{name}.json").read_text()), (folder / f"{name}.html").read_text()


def test_the_phantom_pass_stands_beside_what_came_and_every_figure_of_it_in_the_json(tmp_path: Path) -> None:
    tape = recorded(tmp_path)
    read, page = reported(tape, tmp_path)
    station, phantom = read["station"], read["station"]["phantom"]
    assert (station["state"], station["reason"]) == ("done", "signal for 11 of 12 useful seconds")
    assert (phantom["up_s"], phantom["on_path_s"], phantom["largest_off_deg"]) == (18.0, 15.0, 0.123)
    assert phantom["came_up_s"] == pytest.approx(phantom["came_on_path_s"] + phantom["came_lost_s"], abs=0.11)
    assert phantom["came_on_path_s"] > 5.0
    assert [(one["lasted_s"], one["came_lost_s"]) for one in phantom["lost"]] == [(3.0, 0.0)]
    known = numbers_in(read) | {str(len(read["losses"]))}
    assert set(NUMBER.findall(times_and_words_left_out(shown(page)))) - known == set()
    assert all(said in shown(page) for said in ("phantom pass", "unwound by 360 deg", "kept back: x: 7", "sent <all>"))
    assert not any(said in page for said in ("<cannot>", "<all>"))
    assert "during_pass" in shown(page)
    assert "still running" in shown(page)
    assert read["hooks"] == [AFTER]
    assert record_path(tape) in messages_beside(tape)


def test_a_pass_that_was_not_flown_before_says_so(tmp_path: Path) -> None:
    read, page = reported(recorded(tmp_path, phantom=None, reason=""), tmp_path)
    assert read["station"]["phantom"] is None
    assert "not flown before" in page


@pytest.mark.parametrize("text", ["{", "[]", '{"state": "done"}', '{"state": 1, "reason": 2, "locked_s": null}'])
def test_one_that_is_damaged_is_told_and_the_recording_has_its_report(tmp_path: Path, text: str) -> None:
    tape = tmp_path / f"one{SUFFIX}"
    record_path(tape).write_text(text)
    with capture_logs() as logs:
        assert read_record(tape) is None
    assert [one["event"] for one in logs] == ["report.without_station"]


def test_a_station_writes_it_with_the_hooks_of_this_pass_alone_and_what_the_phantom_pass_found(tmp_path: Path) -> None:
    made: list[Path] = []

    def fake_hooks(access: StationAccess) -> None:
        """No program is started in virtual time: each ends at once."""
        hooks = access.runs.day.hooks

        def call(hook: Hook, about: Mapping[str, Any]) -> None:
            problem = "exit status 3" if hook is Hook.BEFORE_PASS else ""
            hooks._end(HookResult(hook, 3 if problem else 0, 1.0, "", problem, about.get("number", 0)))

        hooks.call = call  # type: ignore[method-assign]
        number = next(one.number for one in access.runs.day.keeper.book if one.satellite == "scd")
        call(Hook.ON_NO_GO, {"number": number})
        call(Hook.ON_NO_GO, {"number": number + 1000})

    async def report(tape: TapeFile, _files: Writer, _config: Path) -> None:
        made.append(tape.path)

    config, state = configured(tmp_path / "config"), tmp_path / "state"
    state.mkdir()
    run_days(config, state, START, START + 230.0, script=[(START + 1.5, fake_hooks)], report=report, has_phantom=True)
    [tape] = state.glob(f"passes/*{SUFFIX}")
    assert made == [tape]
    read = json.loads(record_path(tape).read_text())
    names = [one["hook"] for one in read["hooks"]]
    assert (names[0], names[-1]) == ("on_no_go", "after_pass")
    assert [names.count(name) for name in ("on_no_go", "before_pass", "after_pass")] == [1, 1, 1]
    assert {"at_lock", "during_pass"} <= set(names)
    assert read["running_hooks"] == []
    assert "hook before_pass: exit status 3" in read["reason"]
    known = read_record(tape)
    assert known is not None
    assert known.phantom is not None
    assert known.phantom.record == {
        **read["phantom"],
        "lost": known.phantom.record["lost"],
        "told": known.phantom.told,
        "kept_back": known.phantom.kept_back,
    }
    assert reported(tape, tmp_path)[0]["station"]["phantom"]["up_s"] == pytest.approx(known.phantom.up_s, abs=0.06)


@pytest.mark.realtime
async def test_the_report_is_made_after_a_hook_that_ends_late_and_the_file_is_there_meanwhile(tmp_path: Path) -> None:
    tape: Any = SimpleNamespace(path=tmp_path / f"one{SUFFIX}")
    go_on, read_at_report = tmp_path / "go-on", []
    wait = f'while [ ! -e "{go_on}" ]; do sleep 0.05; done; echo sent'
    hooks = Hooks({Hook.AFTER_PASS: ["/bin/sh", "-c", wait]}, 60.0)
    entry: Any = SimpleNamespace(
        number=7, satellite="scd", name="scd", useful_s=0.0, reason="", is_resumed=False, state=PassState.PASS
    )
    keeper: Any = SimpleNamespace(change=lambda given, _state, _reason: given)
    course = PassCourse(keeper, hooks, lambda one: {"number": one.number})
    course.begun(entry, None)
    course.ended(None, "the line was lost")

    async def report(kept: TapeFile, _files: Writer, _config: Path) -> None:
        read_at_report.append(json.loads(record_path(kept.path).read_text()))

    files: Any = SimpleNamespace(put=lambda job: job())
    setup: Any = SimpleNamespace(files=files, report=report, config=tmp_path)
    day: Any = SimpleNamespace(
        course=course, hooks=hooks, station=SimpleNamespace(hooks=SimpleNamespace(time_limit_s=60.0))
    )
    reports = PassReports(setup, day)
    reports.make(tape, has_report=True)
    assert json.loads(record_path(tape.path).read_text())["running_hooks"] == ["after_pass"]
    assert read_at_report == []
    go_on.touch()
    async with asyncio.timeout(90.0):
        await asyncio.gather(*reports._making)
    [read] = read_at_report
    assert (read["state"], read["reason"], read["running_hooks"]) == ("failed", "the line was lost", [])
    assert [(one["hook"], one["said"], one["status"]) for one in read["hooks"]] == [("after_pass", "sent", 0)]
    await reports.close()
    await hooks.close()

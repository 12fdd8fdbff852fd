"""edge.hooks with real programs: what they are told, and that none of them can hold the loop up."""

import asyncio
import json
import os
import signal
import sys
from pathlib import Path

import pytest

from acu_daemon.edge import hooks as module
from acu_daemon.edge.hooks import Hook, HookResult, Hooks

pytestmark = pytest.mark.realtime
ABOUT = {"satellite": 'A "quoted" name', "rise_utc": "2026-12-01T00:00:00Z"}


async def run(command: list[str], hook: Hook = Hook.BEFORE_PASS, limit_s: float = 20.0) -> HookResult:
    hooks = Hooks({hook: command}, limit_s)
    hooks.call(hook, ABOUT)
    await asyncio.gather(*hooks._running)
    [result] = hooks.take_results()
    assert hooks.take_results() == []
    return result


def shell(text: str) -> list[str]:
    return ["/bin/sh", "-c", text]


async def test_a_hook_gets_what_happens_as_one_line_of_json_and_its_words_are_kept():
    result = await run(shell("cat; echo $ACU_HOOK >&2"))
    assert (result.status, result.problem) == (0, "")
    line, name = result.said.splitlines()
    assert json.loads(line) == {"hook": "before_pass"} | ABOUT
    assert name == "before_pass"


async def test_it_has_a_group_of_its_own_and_low_priority():
    program = "import os, sys; print(os.getpgid(0) != int(sys.argv[1]), os.nice(0))"
    result = await run([sys.executable, "-c", program, str(os.getpgid(0))])
    assert result.said == f"True {min(19, os.nice(0) + 10)}"


@pytest.mark.parametrize(
    ("command", "status", "problem"),
    [
        (shell("exit 3"), 3, "exit status 3"),
        (shell("kill -9 $$"), -9, "ended by signal 9"),
        (shell("exec </dev/null; exit 0"), 0, ""),
        (["/nonexistent/program"], 127, "exit status 127"),
    ],
)
async def test_how_a_hook_ends_is_told(command, status, problem):
    result = await run(command)
    assert (result.status, result.problem) == (status, problem)


@pytest.mark.parametrize("text", ["sleep 600 & sleep 600", "yes", "trap '' TERM; while :; do sleep 0.1; done"])
async def test_one_that_hangs_forks_or_prints_without_end_is_killed_with_its_group(text, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "GRACE_S", 0.5)
    pid_file = tmp_path / "pid"
    result = await run(shell(f"echo $$ > {pid_file}; {text}"), limit_s=1.0)
    assert result.problem == "killed after 1 s"
    assert result.status in (-signal.SIGTERM, -signal.SIGKILL)
    group = os.getpgid(0)
    assert not [one for one in members(int(pid_file.read_text())) if one != group]


async def test_a_grandchild_that_keeps_the_pipe_open_holds_nothing_up(tmp_path):
    result = await run(shell("sleep 5 & echo started"))
    assert (result.status, result.problem) == (0, "")
    assert result.lasted_s < 5.0


async def test_what_runs_during_a_pass_ends_with_it(tmp_path):
    marks = tmp_path / "marks"
    text = f"trap 'echo ended >> {marks}; exit 0' TERM; echo begun >> {marks}; while :; do sleep 0.05; done"
    hooks = Hooks({Hook.DURING_PASS: shell(text)}, 20.0)
    hooks.call(Hook.DURING_PASS, ABOUT)
    while not marks.exists():
        await asyncio.sleep(0.01)
    hooks.end_during()
    await hooks.close()
    assert marks.read_text().split() == ["begun", "ended"]


async def test_what_is_ending_as_the_daemon_ends_keeps_its_grace(tmp_path):
    marks = tmp_path / "marks"
    text = (
        f"trap 'echo told >> {marks}; sleep 0.3; echo ended >> {marks}; exit 0' TERM; echo begun >> {marks}; "
        "while :; do sleep 0.05; done"
    )
    hooks = Hooks({Hook.DURING_PASS: shell(text)}, 20.0)
    hooks.call(Hook.DURING_PASS, ABOUT)
    while not marks.exists():
        await asyncio.sleep(0.01)
    hooks.end_during()
    while "told" not in marks.read_text():
        await asyncio.sleep(0.01)
    await hooks.close()
    assert marks.read_text().split() == ["begun", "told", "ended"]


async def test_what_ends_while_it_is_being_started_is_asked_to_end_as_any_other(tmp_path, monkeypatch):
    marks = tmp_path / "marks"

    async def start_slowly(*command, **pipes):
        process = await start(*command, **pipes)
        while not marks.exists() or marks.read_text() != "begun\n":
            await asyncio.sleep(0.01)
        has_begun.set()
        await asyncio.sleep(0.2)
        return process

    start, has_begun = module.start, asyncio.Event()
    monkeypatch.setattr(module, "start", start_slowly)
    text = f"trap 'echo ended >> {marks}; exit 0' TERM; echo begun >> {marks}; while :; do sleep 0.05; done"
    hooks = Hooks({Hook.DURING_PASS: shell(text)}, 20.0)
    hooks.call(Hook.DURING_PASS, ABOUT)
    await has_begun.wait()
    hooks.end_during()
    await hooks.close()
    assert marks.read_text().split() == ["begun", "ended"]
    [result] = hooks.take_results()
    assert (result.status, result.problem) == (0, "")


async def test_too_many_at_once_are_refused_and_told(monkeypatch):
    monkeypatch.setattr(module, "MOST_RUNNING", 2)
    hooks = Hooks({Hook.ON_ALARM: shell("sleep 60")}, 20.0)
    for _ in range(3):
        hooks.call(Hook.ON_ALARM, ABOUT)
    [refused] = hooks.take_results()
    assert refused.problem == "not started: 2 hooks are running"
    await hooks.close()


def members(group: int) -> list[int]:
    """Processes of a group that still run."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group and fields[0] != "Z":
            found.append(int(path.parent.name))
    return found


async def test_of_what_a_hook_prints_the_last_is_kept() -> None:
    printed = asyncio.StreamReader()
    printed.feed_data(b"good morning" + b"." * 3 * module.KEPT_BYTES + b"no such device")
    printed.feed_eof()
    kept = await module._read(printed)
    assert len(kept) == module.KEPT_BYTES
    assert kept.endswith(b"no such device")
    assert await module._read(None) == b""

"""edge.hook_rights: what a hook has of the daemon's rights, told by the hook itself."""

import asyncio
import json
import os
import pwd
import sys
from pathlib import Path

import pytest
from config_files import BROUWER, STATION, write

from acu_daemon.cli.check_hooks import hooks_finding
from acu_daemon.cli.station_day import StationDay
from acu_daemon.config.load import load_station
from acu_daemon.config.station_day_tables import HooksSection
from acu_daemon.edge import hook_rights
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.hook_rights import HookUser, chosen_user, hook_user, launch
from acu_daemon.edge.hooks import Hook, HookResult, Hooks
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.errors import UsageError

TELL = """import json, os, sys
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
keys = "Uid Gid Groups CapPrm CapEff CapInh CapAmb NoNewPrivs".split()
told = {key: status[key].split() for key in keys}
told |= dict(nice=os.nice(0), policy=os.sched_getscheduler(0), umask=os.umask(0), cwd=os.getcwd(),
    fds=sorted(int(one) for one in os.listdir("/proc/self/fd")), environment=dict(os.environ))
print(json.dumps(told))
"""
NOBODY = "nobody"
NO_CAPABILITY = ["0" * 16]
needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root may start programs as another user")


async def told_by(user: HookUser | None) -> dict[str, object]:
    hooks = Hooks({Hook.BEFORE_PASS: [sys.executable, "-c", TELL]}, 60.0, user)
    hooks.call(Hook.BEFORE_PASS, {})
    result = await done(hooks)
    assert result.is_good, result
    told: dict[str, object] = json.loads(result.said)
    return told


async def done(hooks: Hooks) -> HookResult:
    await hooks.ended(0, 60.0)
    [result] = hooks.take_results()
    return result


@pytest.mark.realtime
@needs_root
async def test_a_hook_of_another_user_is_that_users_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NOTIFY_SOCKET", "ACU_TOKEN", "STATE_DIRECTORY"):
        monkeypatch.setenv(name, "secret")
    kept = os.open("/etc/hostname", os.O_RDONLY)
    os.set_inheritable(kept, True)
    try:
        told = await told_by(hook_user(NOBODY))
    finally:
        os.close(kept)
    them = pwd.getpwnam(NOBODY)
    assert (told["Uid"], told["Gid"]) == ([str(them.pw_uid)] * 4, [str(them.pw_gid)] * 4)
    assert told["Groups"] == [str(gid) for gid in sorted(os.getgrouplist(NOBODY, them.pw_gid))]
    assert [told[key] for key in ("CapPrm", "CapEff", "CapInh", "CapAmb")] == [NO_CAPABILITY] * 4
    assert told["NoNewPrivs"] == ["1"]
    assert (told["nice"], told["policy"]) == (min(19, os.nice(0) + 10), os.SCHED_OTHER)
    assert (told["umask"], told["cwd"], told["fds"]) == (0o027, "/", [0, 1, 2, 3])  # 3: that of the list itself
    environment = told["environment"]
    assert isinstance(environment, dict)
    assert set(environment) <= {*hook_rights.KEPT, "ACU_HOOK"} | {one for one in environment if one.startswith("LC_")}
    assert (environment["USER"], environment["HOME"]) == (NOBODY, them.pw_dir)


@pytest.mark.realtime
async def test_a_hook_of_the_daemons_own_user_can_gain_nothing_and_knows_no_secret(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", "secret")
    told = await told_by(None)
    assert told["Uid"] == [str(os.geteuid())] * 4
    assert (told["CapInh"], told["CapAmb"], told["NoNewPrivs"]) == (NO_CAPABILITY, NO_CAPABILITY, ["1"])
    assert "secret" not in json.dumps(told["environment"])


@pytest.mark.realtime
@needs_root
async def test_one_of_another_user_that_hangs_is_ended() -> None:
    hooks = Hooks({Hook.BEFORE_PASS: ["sleep", "600"]}, 1.0, hook_user(NOBODY))
    hooks.call(Hook.BEFORE_PASS, {})
    assert (await done(hooks)).problem == "killed after 1 s"


def test_a_user_who_is_not_there_or_may_not_be_become_is_refused_with_its_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(UsageError, match="'no-such-user': this machine has no such user"):
        chosen_user("no-such-user")
    monkeypatch.setattr(hook_rights, "_status", lambda _key: 0)
    monkeypatch.setattr(hook_rights.os, "geteuid", lambda: 4711)
    with pytest.raises(UsageError, match="run it as root, or with CAP_SETUID, CAP_SETGID, CAP_KILL"):
        chosen_user(NOBODY)


def test_where_nothing_is_left_to_shed_nothing_is_done_that_a_sandbox_denies(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hook_rights, "_status", lambda key: int(key == "NoNewPrivs"))
    assert launch(["horn"], None)[3:] == ["horn"]
    monkeypatch.setattr(hook_rights, "_status", lambda key: int(key in ("NoNewPrivs", "CapAmb")))
    assert launch(["horn"], None)[3] == "setpriv"


def test_the_check_says_as_whom_they_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def said(**keys: object) -> tuple[str, str]:
        found = hooks_finding(HooksSection.model_validate({"after_pass": ["store"]} | keys))
        assert found is not None
        return found.verdict, found.detail

    assert hooks_finding(HooksSection(user="no-such-user")) is None
    assert said(user="no-such-user")[0] == "NO-GO"
    monkeypatch.setattr(hook_rights.os, "geteuid", lambda: 0)
    assert said() == ("WARN", "run as root; name a [hooks] user that may do less")
    monkeypatch.setattr(hook_rights, "_status", lambda _key: -1)
    assert said(user=NOBODY)[0] == "GO"
    monkeypatch.setattr(hook_rights, "_status", lambda _key: 0)
    assert said(user=NOBODY)[0] == "WARN"
    monkeypatch.setattr("acu_daemon.cli.check_hooks.is_there_a_launcher", lambda: False)
    assert "install util-linux" in said(user=NOBODY)[1]


async def test_a_reload_takes_other_hooks_and_one_whose_user_is_not_there_keeps_those_before(tmp_path: Path) -> None:
    config, state = write(tmp_path / "config", scd=BROUWER), tmp_path / "state"
    state.mkdir()

    async def beside(*_: object) -> object:
        raise UsageError("nothing is planned here")

    day = StationDay(config, SystemClock(), ScheduleFile(state), load_station(config), beside=beside)

    async def reloaded(hooks: str) -> dict[Hook, tuple[str, ...]]:
        write(config, f"{STATION}\n[hooks]\n{hooks}\n")
        day.ask_reload()
        day.look()
        await asyncio.sleep(0)  # the plan fails
        day.look()
        return day.hooks._commands

    assert await reloaded('on_alarm = ["first"]') == {Hook.ON_ALARM: ("first",)}
    assert await reloaded('on_alarm = ["second"]\nuser = "no-such-user"') == {Hook.ON_ALARM: ("first",)}
    await day.close()
    await asyncio.sleep(0)

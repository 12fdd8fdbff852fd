"""One clock for a rehearsal: of a living process of this user at this ACU with the same --at, and of nobody else."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from acu_daemon.cli.rehearsal import clock_text, meet_in_rehearsal, met_by_chance
from acu_daemon.edge.acu_place import file_name, place_of
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.rehearsal_clock import Meeting, Role, SharedClock, lead, meet

URL = "tcp://127.0.0.1:3842"
AT = "1989-02-01T01:58:30Z"
ACU = SharedClock(1000.0, 400.0)
DAEMON = SharedClock(1000.0, 385.0)  # started 15 s later
LEAVES = """
import sys
from acu_daemon.edge.rehearsal_clock import Role, SharedClock, meet
met = meet(sys.argv[1], Role.ACU, SharedClock(1000.0, 400.0), may_take=True)
print("left", flush=True)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "acu-daemon"


def taken(url: str = URL, own: SharedClock = DAEMON, role: Role = Role.DAEMON, *, may_take: bool = True) -> Meeting:
    with meet(url, role, own, may_take=may_take) as met:
        return met


@pytest.mark.parametrize("url", [URL, "tcp://localhost:3842", "tcp://[::1]:3842", f"{URL}?baud=9600"])
def test_the_daemon_takes_the_simulators_clock_by_whatever_name_it_dials_this_machine(url: str) -> None:
    with meet(URL, Role.ACU, ACU, may_take=True):
        met = taken(url)
        assert (met.is_taken, met.clock.offset_s, met.clock.pid) == (True, 400.0, os.getpid())
    assert not taken(url).is_taken


def test_a_simulator_on_all_addresses_gives_its_clock_and_takes_the_daemons() -> None:
    with meet("tcp://0.0.0.0:3842", Role.ACU, ACU, may_take=True):
        assert taken().is_taken
    with meet(URL, Role.DAEMON, DAEMON, may_take=True):
        assert taken("tcp://0.0.0.0:3842", ACU, Role.ACU).clock.offset_s == 385.0


def test_a_simulator_that_is_started_again_in_mid_rehearsal_takes_the_daemons_clock() -> None:
    with meet(URL, Role.ACU, ACU, may_take=True) as first, meet(URL, Role.DAEMON, DAEMON, may_take=True):
        first.close()
        again = taken(URL, SharedClock(1000.0, 100.0), Role.ACU)
        assert (again.is_taken, again.clock.offset_s) == (True, 400.0)


@pytest.mark.parametrize(
    "other", ["tcp://127.0.0.1:3843", "tcp://127.0.0.2:3842", "tcp://192.0.2.7:3842", "serial:///dev/ttyUSB0"]
)
def test_the_clock_at_another_acus_address_is_never_taken(other: str) -> None:
    with meet(URL, Role.ACU, ACU, may_take=True):
        assert taken(other).other is None


def test_of_one_address_alone_a_simulator_never_takes_the_clock_of_the_daemon_at_another() -> None:
    with meet("tcp://127.0.0.2:3842", Role.DAEMON, DAEMON, may_take=True):
        assert taken(URL, ACU, Role.ACU).other is None


def test_another_at_and_a_clock_given_to_the_instant_are_kept_and_the_difference_is_told() -> None:
    with meet(URL, Role.ACU, ACU, may_take=True):
        for met in (taken(own=SharedClock(1001.0, 385.0)), taken(may_take=False)):
            assert (met.is_taken, met.clock.offset_s, met.apart_s) == (False, 385.0, 15.0)
            text, is_warning = clock_text(met, Role.DAEMON, 0.0)
            assert is_warning
            assert "15.0 s ahead" in text
            assert "start both with the same --at" in text


def test_what_a_killed_process_left_counts_for_nothing_and_a_living_ones_does() -> None:
    command = [sys.executable, "-c", LEAVES, URL]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "left\n"
        assert taken().clock == SharedClock(1000.0, 400.0, process.pid)
        process.kill()
    assert taken().other is None


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", "[" * 3000, '{"version": 1}', '{"version": 1, "place": 3, "offset_s": NaN}']
)
def test_a_file_that_makes_no_sense_counts_for_nothing(runtime: Path, text: str) -> None:
    with meet(URL, Role.ACU, ACU, may_take=True):
        (runtime / f"{file_name(place_of(URL))}.acu.json").write_text(text)
        assert taken().other is None


@pytest.mark.parametrize("offset", ["1", 10**400, None, True])
def test_a_clock_that_is_no_number_counts_for_nothing(runtime: Path, offset: object) -> None:
    with meet(URL, Role.ACU, ACU, may_take=True):
        path = runtime / f"{file_name(place_of(URL))}.acu.json"
        path.write_text(json.dumps({**json.loads(path.read_text()), "offset_s": offset}))
        assert taken().other is None


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
@pytest.mark.parametrize("what", ["file", "directory"])
def test_another_users_clock_is_never_taken(runtime: Path, what: str) -> None:
    with meet(URL, Role.ACU, ACU, may_take=True):
        os.chown(next(runtime.glob("*.acu.json")) if what == "file" else runtime, 65534, 65534)
        met = taken()
        assert (met.other, met.is_taken) == (None, False)
        assert (met.problem != "") == (what == "directory")


def test_a_directory_that_others_may_write_to_or_that_is_a_link_is_not_used_and_told(
    runtime: Path, tmp_path: Path
) -> None:
    runtime.mkdir()
    runtime.chmod(0o777)
    assert "not this user's alone" in taken().problem
    runtime.rmdir()
    (tmp_path / "elsewhere").mkdir()
    runtime.symlink_to(tmp_path / "elsewhere")
    text, is_warning = clock_text(taken(), Role.DAEMON, 0.0)
    assert is_warning
    assert "give both the same --at-monotonic" in text


def test_behind_a_line_with_faults_the_simulators_clock_is_found_and_the_daemons_too() -> None:
    proxy = "tcp://127.0.0.1:4000"
    acu = meet(URL, Role.ACU, ACU, may_take=True)
    with lead(proxy, URL), acu, meet(proxy, Role.DAEMON, DAEMON, may_take=True) as daemon:
        assert daemon.is_taken
        acu.close()
        assert taken(URL, SharedClock(1000.0, 1.0), Role.ACU).clock.offset_s == 400.0
    with lead(proxy, URL), lead(URL, proxy):
        assert taken(proxy).other is None  # lines that lead to each other


def test_a_second_simulator_at_one_address_does_not_disturb_the_first_ones_clock() -> None:
    with meet(URL, Role.ACU, ACU, may_take=True):
        taken(URL, SharedClock(1000.0, 7.0), Role.ACU)
        assert taken().clock.offset_s == 400.0


def test_a_free_port_gets_its_clock_once_it_is_known() -> None:
    with meet("tcp://127.0.0.1:0", Role.ACU, ACU, may_take=True) as met:
        met.move_to("tcp://127.0.0.1:4001")
        assert taken("tcp://127.0.0.1:4001").is_taken


def test_a_pseudo_terminal_is_found_by_its_link_also_through_another_name_of_its_folder(tmp_path: Path) -> None:
    (tmp_path / "same").symlink_to(tmp_path)
    with meet(f"serial://{tmp_path}/acu", Role.ACU, ACU, may_take=True):
        assert taken(f"serial://{tmp_path}/same/acu?baud=9600").is_taken


def test_a_run_that_is_no_rehearsal_leaves_no_clock_and_is_told_of_a_simulator_at_another_time(runtime: Path) -> None:
    clock, met = meet_in_rehearsal("", Role.DAEMON, None, None)
    assert (clock.is_rehearsal, runtime.exists()) == (False, False)
    assert clock_text(met, Role.DAEMON, 0.0)[1] is False
    with meet_in_rehearsal(URL, Role.ACU, AT, None)[1]:
        text, is_warning = clock_text(met_by_chance(URL, SystemClock()), Role.DAEMON, 0.0)
        assert is_warning
        assert "started with --at 1989-02-01T01:58:30.000Z) is " in text
    with meet_in_rehearsal(URL, Role.ACU, None, None)[1]:  # both now
        assert clock_text(met_by_chance(URL, SystemClock()), Role.DAEMON, 0.0)[1] is False


def test_the_first_one_says_that_the_clock_is_its_own_and_the_second_one_how_long_it_has_run() -> None:
    first, at_acu = meet_in_rehearsal(URL, Role.ACU, AT, None)
    with at_acu:
        assert clock_text(at_acu, Role.ACU, 0.0)[0].startswith("its own: a daemon")
        second, met = meet_in_rehearsal(URL, Role.DAEMON, "1989-02-01T01:58:30.000Z", None)
        with met:
            text, is_warning = clock_text(met, Role.DAEMON, met.clock.begun_s + 15.0)
            assert not is_warning
            assert text.startswith(f"that of the simulator (process {os.getpid()}), now 15.0 s after --at")
            assert second.tai_s() - first.tai_s() == pytest.approx(0.0, abs=0.01)
    with meet_in_rehearsal(URL, Role.DAEMON, AT, None)[1] as alone:
        assert "of another hand" in clock_text(alone, Role.DAEMON, 0.0)[0]

"""`acu-daemon check`: a line per check, GO, WARN or NO-GO, against ACUs that answer, stay silent, or are not there."""

import contextlib
import json
import os
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from command_line import Done, acu_daemon
from config_files import BROUWER, STATION, from_file, replaced, write
from test_live_line import SEEN

from acu_daemon.acu.commands import AcuMode, Identify, Poll, ReadFaults
from acu_daemon.cli import check, own_daemon
from acu_daemon.cli.check_finding import NO_GO, Finding
from acu_daemon.drivers.sa3842.codec import CMD_OF, CommandDecoder, encode_reply
from acu_daemon.drivers.sa3842.messages import Command, Faults, Identity, Nak, Reply, Status
from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver
from acu_daemon.drivers.sa3842.status_block import decode_status
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.control_socket import SOCKET
from acu_daemon.edge.state_directory import SNAPSHOT, StateOwner, antenna_directory
from acu_daemon.errors import AcuDaemonError
from acu_daemon.orbit.timescales import tai_from_utc

READY = replace(
    decode_status("0" * 23), mode=AcuMode.STANDBY, is_remote_enabled=True, is_receiver_valid=True, agc_db=7.5
)
PLAIN = Identity("3842", "10")
PATIENCE_S = 60.0


class SmallAcu:
    """Answers on a TCP port, from a thread; remembers what it was asked."""

    def __init__(self, status: Status | None, identity: Identity, faults: Faults) -> None:
        self._answers: dict[type, Reply | None] = {Poll: status, Identify: identity, ReadFaults: faults}
        self.asked: list[Command | None] = []
        self._server = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._server.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        with contextlib.suppress(OSError):  # closed
            while True:
                connection, _ = self._server.accept()
                with connection:
                    self._talk(connection)

    def _talk(self, connection: socket.socket) -> None:
        decoder = CommandDecoder()
        while data := connection.recv(100):
            for event in decoder.feed(data, 0.0):
                self.asked.append(event.command)
                reply = self._answers.get(type(event.command), Nak())
                if reply is not None:
                    connection.sendall(encode_reply(CMD_OF[type(event.command)], reply))

    def close(self) -> None:
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        self._thread.join()


@contextlib.contextmanager
def acu(status: Status | None = READY, identity: Identity = PLAIN, faults: Faults | None = None) -> Iterator[SmallAcu]:
    """An ACU; one that answers is waited for, however busy the machine is."""
    made = SmallAcu(status, identity, faults or Faults())
    with pytest.MonkeyPatch.context() as patch:
        if status is not None:
            patch.setattr("acu_daemon.cli.check_acu.ACU_S", PATIENCE_S)
            patch.setattr("acu_daemon.edge.tcp.CONNECT_TIMEOUT_S", PATIENCE_S)
            slow = replace(Sa3842Driver.capabilities, reply_deadline_s=PATIENCE_S / 2.0)
            patch.setattr(Sa3842Driver, "capabilities", slow)
        try:
            yield made
        finally:
            made.close()


class SetClock(SystemClock):
    """Its UTC stands at an instant of the test."""

    utc = "1989-02-01T00:00:00Z"

    def tai_s(self) -> float:
        return tai_from_utc(self.utc)


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """A synchronised clock, fourteen hours after the epoch of the elements."""
    monkeypatch.setattr(check, "is_clock_synchronised", lambda: True)
    monkeypatch.setattr(check, "SystemClock", SetClock)


def station(url: str, more: str = "") -> str:
    return replaced(STATION, "tcp://127.0.0.1:3842", url) + more


def lines(done: Done) -> dict[str, tuple[str, str]]:
    """Verdict and detail of each line by what was checked."""
    assert "Traceback" not in done.err
    *findings, _ = done.out.splitlines()
    return {line[7:29].rstrip(): (line[:6].rstrip(), line[30:]) for line in findings}


def last(done: Done) -> str:
    return done.out.splitlines()[-1]


def test_when_all_is_well_every_line_is_go_and_the_status_0(tmp_path: Path) -> None:
    with acu() as small:
        done = acu_daemon("check", "--config", write(tmp_path, station(small.url), scd=BROUWER))
    found = lines(done)
    assert [(what, verdict) for what, (verdict, _) in found.items()] == [
        ("station.toml", "GO"),
        ("place", "GO"),
        ("clock", "GO"),
        ("leap seconds", "GO"),
        ("air", "GO"),
        ("scd: elements", "GO"),
        ("scd: next pass", "GO"),
        ("scd: cable wrap", "GO"),
        ("line rate", "GO"),
        ("ACU", "GO"),
        ("ACU control", "GO"),
        ("ACU faults", "GO"),
    ]
    assert done.code == 0
    assert last(done) == "GO: ready"
    assert found["ACU"][1] == "SA-3842 10, STANDBY, az 0.00 el 0.00, AGC 7.5 dB"


@pytest.mark.parametrize(
    ("latitude", "longitude", "place"),
    [
        ("-15.53", "-56.07", "15.53 deg south, 56.07 deg west, 277 m; at 1989-02-01T00:00:00Z it is night there, "),
        ("15.53", "303.93", "15.53 deg north, 56.07 deg west, 277 m; at 1989-02-01T00:00:00Z it is night there, "),
        ("-15.53", "123.93", "15.53 deg south, 123.93 deg east, 277 m; at 1989-02-01T00:00:00Z it is day there, "),
    ],
)
def test_the_position_is_told_as_a_place_with_its_daylight(
    tmp_path: Path, latitude: str, longitude: str, place: str
) -> None:
    text = replaced(STATION, "latitude_deg = -15.53", f"latitude_deg = {latitude}")
    text = replaced(text, "longitude_deg = -56.07", f"longitude_deg = {longitude}")
    text = replaced(text, "tcp://127.0.0.1:3842", "serial:///dev/none?baud=4800")
    verdict, said = lines(acu_daemon("check", "--config", write(tmp_path, text)))["place"]
    assert (verdict, said[: len(place)]) == ("GO", place)


def test_the_suns_direction_is_told_as_skyfield_has_it(tmp_path: Path) -> None:
    text = replaced(STATION, "tcp://127.0.0.1:3842", "serial:///dev/none?baud=4800")
    at = ("--at", "1989-02-01T02:00:00Z")
    said = lines(acu_daemon("check", "--config", write(tmp_path, text), *at))["place"][1]
    assert said.endswith("night there, the sun at azimuth 222.8, elevation -46.3 deg")  # tests/test_sun.py


def test_a_check_asks_and_never_changes_anything(tmp_path: Path) -> None:
    with acu() as small:
        acu_daemon("check", "--config", write(tmp_path, station(small.url), scd=BROUWER))
        assert small.asked == [Poll(), Identify(), ReadFaults()]


def test_the_acu_that_a_station_was_started_at_is_asked_in_place_of_its_files(tmp_path: Path) -> None:
    with acu() as there, acu() as other:
        config = write(tmp_path, station(other.url), scd=BROUWER)
        found = {one.what: one for one in check.findings(config, "scd", SetClock().tai_s(), tmp_path, there.url)}
    assert found["station.toml"].detail.endswith(f"ACU at {there.url}")
    assert (found["ACU"].verdict, bool(there.asked), other.asked) == ("GO", True, [])


def test_a_simulated_acu_is_called_a_simulation(tmp_path: Path) -> None:
    with acu(identity=Identity("3842", "S2")) as small:
        done = acu_daemon("check", "--config", write(tmp_path, station(small.url), scd=BROUWER))
    assert "SIMULATION" in lines(done)["ACU"][1]


@pytest.mark.parametrize(
    ("status", "faults", "what", "verdict", "said"),
    [
        (replace(READY, is_remote_enabled=False), None, "ACU control", "NO-GO", "switch the ACU to REMOTE"),
        (replace(READY, mode=AcuMode.MANUAL), None, "ACU control", "NO-GO", "the local panel has control"),
        (replace(READY, mode=AcuMode.FAULT), None, "ACU faults", "NO-GO", "mode FAULT"),
        (READY, Faults(azimuth=1), "ACU faults", "NO-GO", "azimuth over-current"),
        (replace(READY, is_receiver_valid=False), None, "receiver", "WARN", "no AGC, or no demodulator"),
        (replace(READY, mode=AcuMode.STOWED), None, "stow", "WARN", "STOWED: the daemon leaves it"),
    ],
)
def test_what_the_acu_says_is_judged(
    tmp_path: Path, status: Status, faults: Faults | None, what: str, verdict: str, said: str
) -> None:
    with acu(status, faults=faults) as small:
        done = acu_daemon("check", "--config", write(tmp_path, station(small.url), scd=BROUWER))
    assert lines(done)[what][0] == verdict
    assert said in lines(done)[what][1]
    assert done.code == (1 if verdict == "NO-GO" else 0)
    assert last(done) == ("NO-GO: not ready" if verdict == "NO-GO" else "WARN: ready, with warnings")


def test_a_port_that_nobody_listens_on_is_no_go(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as unused:
        url = f"tcp://127.0.0.1:{unused.getsockname()[1]}"
    done = acu_daemon("check", "--config", write(tmp_path, station(url), scd=BROUWER))
    assert done.code == 1
    assert lines(done)["ACU"] == (
        "NO-GO",
        f"nobody listens at {url}: check the port, and that the ACU or the simulator is on",
    )


def test_a_line_that_nobody_answers_on_is_no_go(tmp_path: Path) -> None:
    with acu(status=None) as small:
        done = acu_daemon("check", "--config", write(tmp_path, station(small.url), scd=BROUWER))
    assert done.code == 1
    assert lines(done)["ACU"][0] == "NO-GO"
    assert "no ACU answers: check address and baud rate" in lines(done)["ACU"][1]


def test_a_serial_line_too_slow_for_ten_writes_a_second_is_no_go_with_the_arithmetic(tmp_path: Path) -> None:
    done = acu_daemon("check", "--config", write(tmp_path, station("serial:///dev/none?baud=4800"), scd=BROUWER))
    assert done.code == 1
    assert lines(done)["line rate"][0] == "NO-GO"
    assert "characters of 2.083 ms" in lines(done)["line rate"][1]


def test_a_rehearsal_is_checked_at_its_own_time(tmp_path: Path) -> None:
    with acu() as there:
        write(tmp_path, station(there.url))
        at = acu_daemon("check", "--config", tmp_path, "--at", "1989-02-03T00:00:00Z")
        late = acu_daemon("check", "--config", tmp_path, "--at", "1999-02-03T00:00:00Z")
    assert lines(at)["scd: elements"] == ("GO", "epoch 1989-01-31T09:58:00Z, 2.6 days old")
    assert lines(at)["scd: next pass"][1].startswith("1989-02-03T")
    assert lines(late)["scd: elements"][0] == "NO-GO"
    wrong = acu_daemon("check", "--config", tmp_path, "--at", "soon")
    assert (wrong.code, "--at 'soon': " in wrong.err) == (2, True)


def test_every_satellite_of_the_directory_is_checked_unless_one_is_named(tmp_path: Path) -> None:
    with acu() as small:
        write(
            tmp_path,
            station(small.url),
            good=BROUWER,
            old=replaced(BROUWER, "1989-01-31", "1988-01-31"),
            broken="[satellite]\n",
        )
        everything = acu_daemon("check", "--config", tmp_path)
        one = acu_daemon("check", "--config", tmp_path, "--satellite", "good")
        nobody = acu_daemon("check", "--config", tmp_path, "--satellite", "moon")
    found = lines(everything)
    assert everything.code == 1
    assert found["good: next pass"][0] == "GO"
    assert found["old: elements"][0] == "NO-GO"
    assert "days old, the limit is 30 days" in found["old: elements"][1]
    assert found["broken: files"][0] == "NO-GO"
    assert found["ACU"][0] == "GO"
    assert one.code == 0
    assert not any(what.startswith(("old", "broken")) for what in lines(one))
    assert nobody.code == 1
    assert "no such file; satellites in" in lines(nobody)["moon: files"][1]


def test_a_finding_with_several_complaints_keeps_to_its_line(tmp_path: Path) -> None:
    done = acu_daemon("check", "--config", write(tmp_path, "[station]\n[acu]\n"))
    assert done.code == 1
    [(verdict, detail)] = lines(done).values()
    assert verdict == "NO-GO"
    assert "station.latitude_deg is missing" in detail
    assert "acu.url is missing" in detail


def test_a_satellite_about_to_decay_is_no_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # an object at its last day, from the SGP4 verification set (Vallado et al., AIAA 2006-6753)
    decaying = (
        "1 29141U 85108AA  06170.26783845  .99999999  00000-0  13519-0 0   718\n"
        "2 29141  82.4288 273.4882 0015848 277.2124  83.9133 15.93343074  6828\n"
    )
    monkeypatch.setattr(SetClock, "utc", "2006-06-19T06:30:00Z")
    with acu() as small:
        limits = "[elements.limits]\nmin_semi_major_axis_km = 6400.0\n"
        write(tmp_path, station(small.url), gone=from_file("GONE", "tle", "gone.tle") + limits)
        (tmp_path / "satellites" / "gone.tle").write_text(decaying)
        done = acu_daemon("check", "--config", tmp_path)
    assert done.code == 1
    assert lines(done)["gone: next pass"][0] == "NO-GO"
    assert "the satellite has decayed" in lines(done)["gone: next pass"][1]
    assert lines(done)["ACU"][0] == "GO"


def test_a_wrap_that_cannot_hold_the_pass_is_a_warning(tmp_path: Path) -> None:
    with acu() as small:
        text = replaced(station(small.url), "min_deg = -270.0\nmax_deg = 270.0", "min_deg = 89.0\nmax_deg = 91.0")
        done = acu_daemon("check", "--config", write(tmp_path, text, scd=BROUWER))
    assert lines(done)["scd: cable wrap"][0] == "WARN"
    assert "no turn holds the whole pass" in lines(done)["scd: cable wrap"][1]


def test_a_pass_that_slow_drives_may_be_late_for_is_a_warning(tmp_path: Path) -> None:
    with acu() as small:
        text = station(small.url).replace("max_rate_deg_s = 20.0", "max_rate_deg_s = 0.01")
        done = acu_daemon("check", "--config", write(tmp_path, text, scd=BROUWER))
    verdict, said = lines(done)["scd: approach"]
    assert verdict == "WARN"
    assert "from the far end of its drives the antenna needs 600" in said


def test_manual_arming_and_a_free_running_clock_are_warned_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check, "is_clock_synchronised", lambda: False)
    with acu() as small:
        text = station(small.url, '[safety]\narm = "manual"\n')
        done = acu_daemon("check", "--config", write(tmp_path, text, scd=BROUWER))
    assert lines(done)["arming"][0] == "WARN"
    assert lines(done)["clock"][0] == "WARN"
    assert done.code == 0
    assert last(done) == "WARN: ready, with warnings"


def test_a_latch_and_a_disarm_of_the_last_run_are_told_before_the_next(tmp_path: Path) -> None:
    left = tmp_path / "state"
    with acu() as small:
        asked = ("check", "--config", write(tmp_path, station(small.url), scd=BROUWER), "--state", left)
        assert acu_daemon(*asked).code == 0
    assert not left.exists()  # it changes nothing
    left.mkdir()
    (left / "disarmed").touch()
    with acu() as small:
        asked = ("check", "--config", write(tmp_path, station(small.url), scd=BROUWER), "--state", left)
        disarmed = acu_daemon(*asked)
        (left / "latch").touch()
        latched = acu_daemon(*asked)
    assert (disarmed.code, lines(disarmed)["disarmed"][0]) == (0, "WARN")
    assert "acu-daemon arm" in lines(disarmed)["disarmed"][1]
    assert (latched.code, lines(latched)["latch"][0]) == (1, "NO-GO")
    assert "acu-daemon clear" in lines(latched)["latch"][1]


def test_a_directory_without_satellites_or_files_is_no_go(tmp_path: Path) -> None:
    nothing = acu_daemon("check", "--config", tmp_path)
    assert nothing.code == 1
    assert "station.toml: no such file" in lines(nothing)["station.toml"][1]
    with acu() as small:
        (tmp_path / "station.toml").write_text(station(small.url))
        empty = acu_daemon("check", "--config", tmp_path)
    assert empty.code == 1
    assert "holds no satellite; put a NAME.toml there" in lines(empty)["satellites"][1]


def test_the_health_check_looks_only_whether_the_daemon_ticks(tmp_path: Path) -> None:
    asked = ("check", "--config", tmp_path / "nowhere", "--running", "--state", tmp_path)
    none = acu_daemon(*asked)
    assert none.code == 1
    assert "no daemon has written it" in lines(none)["running daemon"][1]
    (tmp_path / SNAPSHOT).write_text("{}")
    assert acu_daemon(*asked).code == 0
    long_ago = time.time() - 60.0
    os.utime(tmp_path / SNAPSHOT, (long_ago, long_ago))
    stale = acu_daemon(*asked)
    assert stale.code == 1
    assert "s ago" in lines(stale)["running daemon"][1]


def test_the_health_check_looks_at_the_antenna_of_its_configuration(tmp_path: Path) -> None:
    mine, other = (
        StateOwner.of("station", "tcp://127.0.0.1:3842", "1"),
        StateOwner.of("Natal", "serial:///dev/ttyS0", "1"),
    )
    state = tmp_path / "state"
    state.mkdir()
    (antenna_directory(state, other) / SNAPSHOT).write_text("{}")
    asked = ("check", "--config", write(tmp_path / "config"), "--running", "--state", state)
    assert acu_daemon(*asked).code == 1
    (antenna_directory(state, mine) / SNAPSHOT).write_text("{}")
    assert acu_daemon(*asked).code == 0
    done = acu_daemon(*asked, "--rehearsal")
    assert done.code == 1
    assert "state-rehearsal" in lines(done)["running daemon"][1]


def test_a_latch_of_another_station_is_none_of_ours_and_ours_by_an_older_name_is(tmp_path: Path) -> None:
    state = tmp_path / "state"
    state.mkdir()
    config = write(tmp_path / "config")
    asked = ("check", "--config", config, "--state", state)
    (antenna_directory(state, StateOwner.of("Natal", "serial:///dev/ttyS0", "1")) / "latch").touch()
    assert "latch" not in lines(acu_daemon(*asked))
    (antenna_directory(state, StateOwner.of("old name", "tcp://127.0.0.1:3842", "1")) / "latch").touch()
    verdict, text = lines(acu_daemon(*asked))["latch"]
    assert verdict == "NO-GO"
    assert f"`acu-daemon clear --config {config} --state {state}`" in text


def test_an_axis_whose_limits_do_not_hold_the_pass_is_a_warning_with_its_times(tmp_path: Path) -> None:
    with acu() as small:
        config = write(tmp_path, flat_station(station(small.url)), scd=BROUWER)
        done = acu_daemon("check", "--config", config)
    assert (done.code, lines(done)["scd: elevation"][0]) == (0, "WARN")
    said = [line for line in done.out.splitlines() if "scd: elevation" in line]
    assert any("elevation below 7 deg for" in line and "the other axis follows" in line for line in said)


def flat_station(text: str) -> str:
    return replaced(text, "min_deg = 0.0\nmax_deg = 90.0", "min_deg = 7.0\nmax_deg = 30.0")


@contextlib.contextmanager
def daemon(directory: Path, answer: str) -> Iterator[None]:
    """Another program's control socket, which answers every line alike."""
    directory.mkdir(exist_ok=True)
    server = socket.socket(socket.AF_UNIX)
    server.bind(str(directory / SOCKET))
    server.listen()

    def serve() -> None:
        with contextlib.suppress(OSError):  # closed
            while True:
                client, _ = server.accept()
                with client:
                    client.recv(100)
                    client.sendall(answer.encode())

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        server.shutdown(socket.SHUT_RDWR)
        server.close()
        thread.join()
        (directory / SOCKET).unlink()


@pytest.mark.long
@pytest.mark.parametrize("place", ["state", "state-rehearsal", "state/noaa-20"])
@pytest.mark.parametrize(
    ("changes", "told", "words"),
    [
        ({}, "GO", "TRACKING, NOAA-20 sets in 4:32, ON path 0.02 deg"),
        ({"state": "SEARCH"}, "WARN", "SEARCHING"),
        ({"clock_alarm": "the clock is not synchronised"}, "WARN", "the clock is not synchronised"),
    ],
)
def test_in_mid_pass_it_tells_what_the_own_daemon_does_and_does_not_ask_the_acu_that_it_holds(
    tmp_path: Path, place: str, changes: dict[str, str], told: str, words: str
) -> None:
    (tmp_path / "state").mkdir()
    with acu() as small:
        config = write(tmp_path / "config", station(small.url), scd=BROUWER)
        seen = json.dumps(asdict(replace(SEEN, acu=small.url, **changes)))
        with daemon(tmp_path / place, f"ok {seen}\n"):
            done = acu_daemon("check", "--config", config, "--state", tmp_path / "state")
        assert small.asked == []
    verdict, said = lines(done)["running daemon"]
    assert (verdict, done.code) == (told, 0)
    assert "a daemon runs and holds the ACU" in said
    assert words in said
    assert "stop it" not in done.out


def test_a_daemon_of_another_acu_or_one_that_was_killed_says_nothing_of_this_one(tmp_path: Path) -> None:
    state = tmp_path / "state"
    with acu() as small:
        config = write(tmp_path / "config", station(small.url), scd=BROUWER)
        asked = ("check", "--config", config, "--state", state)
        with daemon(state, f"ok {json.dumps(asdict(replace(SEEN, acu='tcp://other:1')))}\n"):
            assert lines(acu_daemon(*asked))["ACU"][0] == "GO"
        with socket.socket(socket.AF_UNIX) as dead:
            dead.bind(str(state / SOCKET))
        found = lines(acu_daemon(*asked))
    assert found["ACU"][0] == "GO"
    assert "running daemon" not in found


def test_a_daemon_that_may_not_be_asked_is_named_and_the_acu_that_it_holds_is_no_no_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(directory: Path, _: str) -> str:
        raise AcuDaemonError(f"{directory / SOCKET}: not permitted; be root (sudo), its user or in its group")

    async def held(_: object) -> list[Finding]:
        return [Finding(NO_GO, "ACU", "tcp://acu:1 was closed at once: another client holds the ACU")]

    monkeypatch.setattr(own_daemon, "ask", refuse)
    monkeypatch.setattr(check, "acu_findings", held)
    config = write(tmp_path / "config", STATION, scd=BROUWER)
    done = acu_daemon("check", "--config", config, "--state", tmp_path / "state")
    found = lines(done)
    assert (found["running daemon"][0], found["ACU"][0], done.code) == ("WARN", "WARN", 0)
    assert "be root (sudo)" in found["running daemon"][1]
    monkeypatch.undo()
    monkeypatch.setattr(check, "acu_findings", held)
    alone = acu_daemon("check", "--config", config, "--state", tmp_path / "state")
    assert (alone.code, lines(alone)["ACU"][0]) == (1, "NO-GO")
    assert "name its state directory with --state" in lines(alone)["ACU"][1]

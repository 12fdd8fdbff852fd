"""The signal as a receiver beside the ACU tells it: read, judged with hysteresis, shown, and never fitted."""

import asyncio
import contextlib
import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import config_files
import pytest
from flights import DEMO_ANTENNA, DEMO_TAI_S, demo_target, sky_of
from rotators import Rotator, fly_rotator
from test_live_line import SEEN
from test_rotator_flights import STATION, brouwer, mid_pass

from acu_daemon.cli.options import load_target
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.cli.virtual_pass import fly
from acu_daemon.config.load import load_station
from acu_daemon.control.receiver_signal import ReceiverSignal, SignalRules, SignalSample, judge_signal
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.goal import Goal, is_reached
from acu_daemon.daemon.overview import status_rows
from acu_daemon.edge.signal_reader import SignalReader, signal_of
from acu_daemon.edge.tape_file import SUFFIX
from acu_daemon.errors import ConfigError
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.sim.scenario import Scenario

RULES = SignalRules(lock_db=6.0, unlock_db=4.0)
UTC = "2026-08-18T12:00:00Z"
NOW = tai_from_utc(UTC)
PAGE = Path(__file__).resolve().parents[1] / "docs" / "receivers.md"
PATIENCE_S = 60.0


class Told:
    """A receiver in memory: what it says at each second from a beginning; None: nothing."""

    def __init__(self, begin_tai_s: float, says: Callable[[float], float | bool | None]) -> None:
        self._begin_tai_s, self._says = begin_tai_s, says
        self.is_open = False

    async def open(self) -> None:
        self.is_open = True

    def now(self, now_tai_s: float) -> SignalSample | None:
        said = self._says(now_tai_s - self._begin_tai_s)
        if said is None:
            return None
        is_word = isinstance(said, bool)
        return SignalSample(now_tai_s, None if is_word else float(said), bool(said) if is_word else None)

    def close(self) -> None:
        self.is_open = False


# Judged


def levels(*given: float | bool) -> list[bool]:
    """Whether it is locked after each word, a second apart."""
    judged, found = ReceiverSignal(), []
    for second, said in enumerate(given):
        is_word = isinstance(said, bool)
        sample = SignalSample(float(second), None if is_word else said, said if is_word else None)
        judged = judge_signal(judged, sample, RULES)
        found.append(judged.is_locked)
    return found


def test_between_the_two_levels_a_lock_stays_what_it_was() -> None:
    assert levels(5.0, 6.0, 5.0, 4.0, 3.9, 5.0, 5.9, 6.1) == [False, True, True, True, False, False, False, True]


def test_the_receivers_own_word_counts_before_the_levels() -> None:
    assert levels(True, False) == [True, False]
    said = SignalSample(1.0, 30.0, False)
    assert not judge_signal(ReceiverSignal(), said, RULES).is_locked


def test_a_word_is_good_for_two_seconds_and_an_older_one_than_the_newest_is_left_out() -> None:
    known = judge_signal(ReceiverSignal(), SignalSample(10.0, 9.0), RULES)
    assert (known.is_known(12.0, RULES), known.is_known(12.1, RULES)) == (True, False)
    assert judge_signal(known, SignalSample(9.9, 0.0), RULES) is known
    assert judge_signal(known, SignalSample(11.0, math.nan), RULES) is known


def test_a_loss_is_timed_from_the_word_that_told_it() -> None:
    heard = ReceiverSignal()
    for tai_s, level_db in ((1.0, 9.0), (2.0, 1.0), (3.0, 1.0)):
        heard = judge_signal(heard, SignalSample(tai_s, level_db), RULES)
    assert heard.lost_tai_s == 2.0
    assert judge_signal(heard, SignalSample(4.0, 9.0), RULES).lost_tai_s is None


# Read


@pytest.mark.parametrize(
    ("text", "level_db", "is_locked", "age_s"),
    [
        (b"12.5", 12.5, None, 0.0),
        (b" -87\n", -87.0, None, 0.0),
        (b'{"db": 3}', 3.0, None, 0.0),
        (b'{"locked": true}', None, True, 0.0),
        (b'{"db": 3.5, "locked": false, "utc": "2026-08-18T11:59:59.5Z", "more": 1}', 3.5, False, 0.5),
    ],
)
def test_a_datagram_is_json_or_a_number(text: bytes, level_db: float, is_locked: bool | None, age_s: float) -> None:
    sample = signal_of(text, NOW)
    assert (sample.level_db, sample.is_locked, NOW - sample.tai_s) == (level_db, is_locked, pytest.approx(age_s))


@pytest.mark.parametrize(
    "text",
    [
        *(b"", b"locked", b"[1]", b"{}", b"nan", b"1e999", b"true", b"1,5", b"null", b"\xff", b"[" * 900, b"1" * 1001),
        *(b'{"db": "3"}', b'{"db": true}', b'{"locked": 1}', b'{"db": 1e300}', b'{"db": 1, "utc": "soon"}'),
        *(b'{"db": 1, "utc": 5}', b'{"db": 1, "utc": "2026-08-18T12:00:02Z"}'),
    ],
)
def test_what_says_nothing_of_a_signal_is_refused_with_a_word(text: bytes) -> None:
    with pytest.raises(ValueError, match=r".+"):
        signal_of(text, NOW)


def test_in_a_rehearsal_the_time_is_that_of_the_arrival() -> None:
    assert signal_of(b'{"db": 1, "utc": "2030-01-01T00:00:00Z"}', NOW, has_own_time=False).tai_s == NOW


def test_of_several_receivers_the_locked_one_counts_then_the_strongest() -> None:
    reader = SignalReader("127.0.0.1:9")
    reader._source.take(b'{"db": 20, "locked": false}', "10.0.0.1")
    reader._source.take(b'{"db": 9, "locked": true}', "10.0.0.2")
    reader._source.take(b"nothing", "10.0.0.3")
    assert reader.now(NOW) == SignalSample(NOW, 9.0, True)
    assert reader.now(NOW) is None


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ('signal = "tcp://1.2.3.4:5"', "expected acu, none, or udp://ADDRESS:PORT"),
        ('signal = "udp://1.2.3.4"', "expected acu, none, or udp://ADDRESS:PORT"),
        ('signal = "udp://1.2.3.4:99999"', "expected acu, none, or udp://ADDRESS:PORT"),
        ("program_track = true", "expected signal"),
        ("signal_lock_db = 3.0", "expected less than signal_lock_db"),
        ('signal_lock_db = "6"', "signal_lock_db"),
    ],
)
def test_a_wrong_key_says_what_is_expected(tmp_path: Path, keys: str, reason: str) -> None:
    config = config_files.write(tmp_path, config_files.STATION + f"[receiver]\n{keys}\n")
    with pytest.raises(ConfigError, match=reason):
        load_station(config)


# Flown


@pytest.mark.long
def test_a_rotator_with_a_receiver_shows_lock_and_loss_and_makes_no_fit(tmp_path: Path) -> None:
    station = STATION + 'signal = "udp://127.0.0.1:4842"\n'
    target = load_target(config_files.write(tmp_path, station), "scd", tai_from_utc("1989-02-01T01:40:00Z"))
    begin = mid_pass(target)

    def says(second: float) -> float | None:
        if 70.0 <= second < 80.0:
            return None
        return 12.0 if 30.0 <= second < 50.0 or second >= 80.0 else 1.0

    told = Told(begin, says)
    tape = tmp_path / f"rotator{SUFFIX}"
    flight = fly_rotator(target, Rotator(place=[200.0, 30.0]), begin, begin + 100.0, signal=told, tape=tape)
    assert replay_pass(tape).difference is None
    assert flight.states() == ["IDLE", "PREPOSITION", "PROGRAM"]
    at = {round(seen.tai_s - begin, 1): seen for seen in flight.snapshots}
    assert [at[t].verdict for t in (29.0, 35.0, 60.0, 75.0, 90.0)] == [
        *("NO SIGNAL YET", "TRACKING", "HOLDING", "PROGRAM TRACK", "TRACKING"),
    ]
    assert at[60.0].signal_lost_s == pytest.approx(10.0, abs=0.2)
    assert at[75.0].signal_alarm == "the receiver says nothing of the signal for 5 s"
    assert (at[60.0].signal_alarm, at[35.0].signal_db) == ("", 12.0)
    assert is_reached(Goal.TRACKING, at[35.0])
    assert not is_reached(Goal.TRACKING, at[60.0])
    assert [event["event"] for event in flight.events if event["event"].startswith("signal.")] == [
        *("signal.locked", "signal.lost", "signal.locked"),
    ]
    assert flight.outcome is not None
    assert flight.outcome.has_acquired
    assert (flight.to_fit_count, len(flight.readings) > 900) == (0, True)
    assert not any(reading.is_locked for reading in flight.readings)
    assert not any(seen.along_s is not None for seen in flight.snapshots)
    assert not told.is_open


def test_an_acu_with_autotrack_that_is_led_by_program_track_makes_no_fit_of_its_own_angles() -> None:
    receiver = {"signal": "udp://127.0.0.1:4842", "program_track": True}
    target = demo_target(receiver=receiver)
    begin = DEMO_TAI_S
    flight = fly(
        target,
        sky_of(target),
        Scenario(acu=DEMO_ANTENNA),
        begin_tai_s=begin,
        end_tai_s=begin + 40.0,
        signal=Told(begin, lambda _second: True),
    )
    assert flight.states()[-1] == "PROGRAM"
    late = [seen for seen in flight.snapshots if seen.tai_s > begin + 20.0]
    assert {seen.verdict for seen in late} == {"TRACKING"}
    assert {seen.buffer_kind for seen in late} == {"TLE"}
    assert not any(reading.is_locked for reading in flight.readings)
    assert not any(seen.rejected_counts for seen in late)


@pytest.mark.long
def test_what_the_acu_calls_acquired_and_the_receiver_denies_is_held_and_not_fitted() -> None:
    target = demo_target(receiver={"signal": "udp://127.0.0.1:4842"})
    begin = DEMO_TAI_S - 120.0

    def says(second: float) -> bool | None:
        return None if second > 70.0 else not 30.0 <= second < 50.0

    flight = fly(
        target,
        sky_of(target),
        Scenario(acu=replace(DEMO_ANTENNA, elevation_deg=25.0, azimuth_deg=168.0)),
        begin_tai_s=begin,
        end_tai_s=begin + 90.0,
        signal=Told(begin, says),
    )
    at = {round(seen.tai_s - begin, 1): seen for seen in flight.snapshots}
    assert [at[t].state for t in (28.0, 40.0, 65.0, 85.0)] == [
        *("AUTOTRACK/FITTED", "HOLD/FITTED", "AUTOTRACK/FITTED", "AUTOTRACK/FITTED"),
    ]
    assert at[40.0].acu_mode == "AUTOTRACK"
    assert at[85.0].signal_alarm
    denied = [one for one in flight.readings if begin + 30.5 < one.tai_s < begin + 49.5]
    assert denied
    assert not any(one.is_locked for one in denied)
    held = [seen for seen in flight.snapshots if 31.0 < seen.tai_s - begin < 49.0]
    assert max(seen.fit_age_s or 0.0 for seen in held) > 15.0
    off = [abs((seen.command_el_deg or 0.0) - (seen.el_deg or 0.0)) for seen in held]
    assert max(off) < 1.0  # the registers hold the path ready, for when the ACU loses it too


def test_status_tells_who_says_what_of_the_signal() -> None:
    told = replace(SEEN, state=str(TrackState.PROGRAM), is_acquired=True, signal_db=9.5, signal_age_s=0.3)
    assert dict(status_rows(told))["signal"].endswith("receiver 9.5 dB 0.3 s ago")
    assert dict(status_rows(replace(SEEN, is_told_of_signal=False)))["signal"] == "nobody tells of it"


def test_a_station_without_a_receiver_is_told_of_no_signal(tmp_path: Path) -> None:
    begin = mid_pass(target := brouwer(tmp_path))
    flight = fly_rotator(target, Rotator(place=[200.0, 30.0]), begin, begin + 20.0)
    assert {seen.is_told_of_signal for seen in flight.snapshots} == {False}
    assert {seen.signal_alarm for seen in flight.snapshots} == {""}


# The examples of docs/receivers.md, each with a stand-in for its program


def example(name: str) -> str:
    found = re.search(rf"^```(?:sh|python) {name}\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    assert found is not None, name
    return found.group(1)


SATDUMP = """
import http.server
class Live(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200 if self.path == "/api" else 404)
        self.end_headers()
        self.wfile.write(b'{"live_pipeline": {"psk_demod": {"snr": 8.25}, "dec": {"deframer_lock": true}}}')
    def log_message(self, *_):
        pass
server = http.server.HTTPServer(("127.0.0.1", 0), Live)
print(server.server_port, flush=True)
server.serve_forever()
"""
RTL_POWER = """#!/bin/sh
[ "$*" = "-f 137.90M:137.93M:1k -i 1 -" ] || exit 2
echo "2026-08-18, 12:00:00, 137900000, 137930000, 1000.00, 20, -58.20, -49.50, -57.90"
exec sleep 60
"""
GNURADIO = """
import sys, types
import numpy as np
class Block:
    def __init__(self, name, in_sig, out_sig): ...
fake = types.ModuleType("gnuradio")
fake.gr = types.SimpleNamespace(sync_block=Block)
sys.modules["gnuradio"] = fake
{block}
assert blk(port={port}).work([np.linspace(0.0, 11.5, 1000, dtype=np.float32)], []) == 1000
"""


async def first_word(reader: SignalReader) -> SignalSample:
    async with asyncio.timeout(PATIENCE_S):
        while (found := reader.now(NOW)) is None:
            await asyncio.sleep(0.01)
    return found


def begun(words: list[str], **more: Any) -> subprocess.Popen[str]:
    """A process that leads a group of its own."""
    return subprocess.Popen(words, text=True, start_new_session=True, **more)


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("name", "level_db", "is_locked"),
    [("satdump", 8.25, True), ("rtl_power", 10.5, None), ("gnuradio", 11.5, None), ("by hand", 9.5, True)],
)
async def test_an_example_of_a_receiver_reaches_the_daemon(
    name: str, level_db: float, is_locked: bool | None, tmp_path: Path
) -> None:
    port = free_port()
    reader = SignalReader(f"127.0.0.1:{port}")
    await reader.open()
    text = example(name).replace("4842", str(port))
    started: list[subprocess.Popen[str]] = []
    try:
        if name == "satdump":
            live = begun([sys.executable, "-c", SATDUMP], stdout=subprocess.PIPE)
            started.append(live)
            assert live.stdout is not None
            text = text.replace("8081", live.stdout.readline().strip())
        if name == "gnuradio":
            text = GNURADIO.replace("{block}", text).replace("{port}", str(port))
            started.append(begun([sys.executable, "-c", text]))
        else:
            (tmp_path / "rtl_power").write_text(RTL_POWER)
            (tmp_path / "rtl_power").chmod(0o755)
            path = f"{tmp_path}:{Path(sys.executable).parent}:/usr/bin:/bin"
            started.append(begun(["bash", "-c", text], env={"PATH": path}))
        found = await first_word(reader)
    finally:
        reader.close()
        for one in started:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(one.pid, signal.SIGKILL)
            one.wait()
            if one.stdout is not None:
                one.stdout.close()
    assert (found.level_db, found.is_locked) == (pytest.approx(level_db, abs=0.06), is_locked)


def test_every_example_of_the_page_is_tried() -> None:
    named = re.findall(r"^```(?:sh|python) (.+)$", PAGE.read_text(), re.MULTILINE)
    assert sorted(named) == ["by hand", "gnuradio", "rtl_power", "satdump"]
    assert json.loads(re.findall(r"^(\{.*\})$", PAGE.read_text(), re.MULTILINE)[0])["locked"] is True

"""MQTT: what is published, and a real Mosquitto: will, password, a broker that goes away for long and comes back."""

import asyncio
import contextlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import time
from ast import literal_eval
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field, replace
from operator import eq, gt, lt, ne
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import aiomqtt
import pytest
from flights import demo_target
from script_modules import load
from structlog.testing import capture_logs
from test_live_line import SEEN

from acu_daemon.cli.outlets_beside import Outlets, read_password
from acu_daemon.config.load import load_station
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.edge.clock import LoopClock
from acu_daemon.errors import ConfigError, UsageError
from acu_daemon.outlets import mqtt_publisher
from acu_daemon.outlets.mqtt_messages import Topics, discovery
from acu_daemon.outlets.mqtt_publisher import BrokerAddress, MqttPublisher, MqttSources
from acu_daemon.sim.virtual import run_virtual
from acu_daemon.web.recent_events import KEPT, RecentEvents

PATIENCE_S = 90.0
MOSQUITTO = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")
needs_mosquitto = pytest.mark.skipif(MOSQUITTO is None, reason="needs mosquitto: apt-get install mosquitto")
pass_rig = load("pass_rig")
TOPICS = Topics("site/dish", "Dish")


# Messages


def test_the_state_is_the_snapshot_with_its_alarms() -> None:
    message = TOPICS.state(replace(SEEN, latch="azimuth stands still"))
    told = json.loads(message.payload)
    assert (message.topic, message.is_retained) == ("site/dish/state", True)
    assert told["az_deg"] == SEEN.az_deg
    assert told["alarms"][0] == "latched: azimuth stands still"


def test_home_assistant_finds_a_device_whose_sensors_are_keys_of_the_state() -> None:
    state = json.loads(TOPICS.state(SEEN).payload)
    found = {message.topic: json.loads(message.payload) for message in discovery(TOPICS, "homeassistant")}
    assert len(found) == 15
    assert all(topic.startswith("homeassistant/") and topic.endswith("/config") for topic in found)
    for topic, told in found.items():
        assert topic.split("/")[3] in state
        assert (told["state_topic"], told["availability_topic"]) == ("site/dish/state", "site/dish/availability")
        assert told["device"]["identifiers"] == ["site_dish"]
    assert len({told["unique_id"] for told in found.values()}) == len(found)
    azimuth = found["homeassistant/sensor/site_dish/az_deg/config"]
    assert (azimuth["unit_of_measurement"], azimuth["suggested_display_precision"]) == ("°", 2)


def value_of(template: str, state: dict[str, Any]) -> str:
    """What a template makes of a state: `ON if value_json.KEY [| length] [operator literal] else OFF`, quoted."""
    found = re.fullmatch(
        r"{{ '(\w+)' if value_json\.(\w+)( \| length)?(?: (!=|==|>|<) (\S+))? else '(\w+)' }}", template
    )
    assert found is not None, template
    then, key, length, operator, literal, otherwise = found.groups()
    value = len(state[key]) if length else state[key]
    if operator:
        compare = {"!=": ne, "==": eq, ">": gt, "<": lt}[operator]
        value = compare(value, literal_eval(literal))
    return then if value else otherwise


def test_a_sensor_that_is_on_or_off_is_so_as_the_snapshot_says() -> None:
    good = replace(SEEN, is_link_up=True, is_acquired=False, latch="")
    made = [json.loads(message.payload) for message in discovery(TOPICS, "homeassistant") if "binary" in message.topic]
    assert len(made) == 4
    for change, changed in (
        ({}, {}),
        ({"is_link_up": False}, {"site_dish_is_link_up": "OFF", "site_dish_alarms": "ON"}),
        ({"is_acquired": True}, {"site_dish_is_acquired": "ON"}),
        ({"latch": "azimuth"}, {"site_dish_latch": "ON", "site_dish_alarms": "ON"}),
    ):
        state = json.loads(TOPICS.state(replace(good, **change)).payload)
        shown = {told["unique_id"]: value_of(told["value_template"], state) for told in made}
        calm = {"is_link_up": "ON", "is_acquired": "OFF", "latch": "OFF", "alarms": "OFF"}
        assert shown == {f"site_dish_{key}": value for key, value in calm.items()} | changed


# Configuration


def configured(directory: Path, keys: str) -> Path:
    shutil.copytree(Path(__file__).resolve().parents[1] / "config", directory / "config")
    station = directory / "config" / "station.toml"
    station.write_text(station.read_text() + f"\n[mqtt]\n{keys}\n")
    return directory / "config"


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ('url = "http://broker:1"', "expected mqtt://HOST:PORT"),
        ('url = "mqtt://me:secret@broker"', "a user and a password have keys of their own"),
        ('url = "mqtt://broker:99999"', "expected mqtt://HOST:PORT"),
        ('topic = "a/#"', "expected a topic without"),
        ('topic = "/a"', "expected a topic without"),
        ('password_file = "x"', "expected a user too"),
    ],
)
def test_a_wrong_key_says_what_is_expected(tmp_path: Path, keys: str, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        load_station(configured(tmp_path, keys))


@pytest.mark.parametrize(
    ("url", "broker"),
    [
        ("mqtt://broker", ("broker", 1883, False)),
        ("mqtts://broker", ("broker", 8883, True)),
        ("mqtt://10.0.0.1:18", ("10.0.0.1", 18, False)),
    ],
)
def test_a_broker_has_its_usual_port(tmp_path: Path, url: str, broker: tuple[str, int, bool]) -> None:
    assert load_station(configured(tmp_path, f'url = "{url}"')).mqtt.broker == broker


def test_a_password_that_others_may_read_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text("secret\n")
    file.chmod(0o644)
    with pytest.raises(UsageError, match="mode 0644, expected a file of 0600"):
        read_password(file)
    file.chmod(0o600)
    assert read_password(file) == "secret"
    for text, reason in ((b"\xff", "UTF-8"), (b"x" * 1025, "at most 1024 bytes")):
        file.write_bytes(text)
        with pytest.raises(UsageError, match=reason):
            read_password(file)
    with pytest.raises(UsageError, match=r"none: No such file or directory$"):
        read_password(tmp_path / "none")
    os.mkfifo(tmp_path / "pipe", 0o600)
    with pytest.raises(UsageError, match="expected a file"):
        read_password(tmp_path / "pipe")


# A broker


class Broker:
    """Debian's broker, on a port of its own."""

    def __init__(self, directory: Path, port: int, more: str = "allow_anonymous true\n") -> None:
        directory.mkdir(exist_ok=True)
        self._port, self._file = port, directory / "mosquitto.conf"
        self._file.write_text(f"listener {port} 127.0.0.1\n{more}")
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        with self._file.with_suffix(".log").open("a") as log:
            self._process = subprocess.Popen([str(MOSQUITTO), "-c", str(self._file)], stdout=log, stderr=log)
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self._port), 1.0):
                return
            time.sleep(0.05)
        raise AssertionError("the broker does not listen")

    def kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait(PATIENCE_S)


@contextlib.contextmanager
def mosquitto(directory: Path, port: int, more: str = "allow_anonymous true\n") -> Iterator[Broker]:
    broker = Broker(directory, port, more)
    broker.start()
    try:
        yield broker
    finally:
        broker.kill()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@dataclass
class Station:
    """What a station has to tell."""

    seen: Snapshot = SEEN
    passes: list[Any] = field(default_factory=list)
    events: RecentEvents = field(default_factory=RecentEvents)

    def sources(self) -> MqttSources:
        return MqttSources(lambda: self.seen, lambda: (self.events.count, self.events.lines), lambda: self.passes)


@contextlib.asynccontextmanager
async def published(station: Station, port: int, **more: Any) -> AsyncIterator[MqttPublisher]:
    broker = BrokerAddress("127.0.0.1", port, **more)
    publisher = MqttPublisher(broker, TOPICS, station.sources(), (0.05, 0.2))
    task = asyncio.create_task(publisher.run())
    try:
        yield publisher
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


@contextlib.asynccontextmanager
async def listening(port: int, *topics: str, **more: Any) -> AsyncIterator[Callable[[str], Any]]:
    """A client of its own; yields what waits for the next message of a topic."""
    async with aiomqtt.Client("127.0.0.1", port, **more) as client:
        for topic in topics:
            await client.subscribe(topic, qos=1)
        messages = client.messages.__aiter__()

        async def following(topic: str) -> bytes:
            async with asyncio.timeout(PATIENCE_S):
                while True:
                    message = await messages.__anext__()
                    if message.topic.matches(topic):
                        return bytes(message.payload)

        yield following


@needs_mosquitto
@pytest.mark.realtime
async def test_a_real_broker_is_told_state_events_schedule_and_home_assistant(tmp_path: Path) -> None:
    port, station = free_port(), Station(passes=[{"satellite": "SCD-1"}])
    station.events.add({"event": "state.changed", "state": "PREPOSITION", "level": "info"})
    with mosquitto(tmp_path / "broker", port):
        async with published(station, port), listening(port, "site/#", "homeassistant/#") as following:
            assert await following("site/dish/availability") == b"online"
            assert json.loads(await following("homeassistant/sensor/site_dish/az_deg/config"))["name"] == "Azimuth"
            assert json.loads(await following("site/dish/state"))["state"] == SEEN.state
            station.events.add({"event": "signal.lost", "level": "warning"})
            told = json.loads(await following("site/dish/event"))
            told = told if told["event"] == "signal.lost" else json.loads(await following("site/dish/event"))
            assert (told["event"], told["level"]) == ("signal.lost", "warning")
            station.passes = [{"satellite": "NOAA 20"}]
            assert json.loads(await following("site/dish/schedule")) == station.passes
            async with listening(port, "site/#") as following:  # what is kept, for who comes later
                assert await following("site/dish/availability") == b"online"
        async with listening(port, "site/#") as following:
            assert await following("site/dish/availability") == b"offline"


@needs_mosquitto
@pytest.mark.realtime
async def test_a_broker_that_was_gone_for_an_hour_is_told_the_newest_and_nothing_has_queued(tmp_path: Path) -> None:
    port, station = free_port(), Station()
    with mosquitto(tmp_path / "broker", port) as broker:
        async with published(station, port) as publisher:
            async with listening(port, "site/dish/state") as following:
                await following("site/dish/state")
            first_count = publisher.connect_count
            broker.kill()
            for second in range(3600):  # an hour of them, as fast as they can be told
                station.seen = replace(SEEN, tai_s=SEEN.tai_s + second)
                station.events.add({"event": "tick", "number": second, "level": "info"})
                if second % 100 == 0:
                    await asyncio.sleep(0.01)
            assert len(station.events.lines()) == KEPT
            broker.start()
            async with listening(port, "site/dish/+") as following:
                told = json.loads(await following("site/dish/state"))
                assert told["tai_s"] == SEEN.tai_s + 3599
            assert publisher.connect_count > first_count


class ScriptedBroker(MqttPublisher):
    """A publisher whose broker is gone, there for so many seconds, or answers what nobody expected, as it is told."""

    def __init__(self, answers: Callable[[float], float | Exception]) -> None:
        super().__init__(BrokerAddress("127.0.0.1", 1), TOPICS, Station().sources())
        self._answers = answers
        self.tries_s: list[float] = []

    async def _publish_until_gone(self) -> None:
        now_s = asyncio.get_running_loop().time()
        self.tries_s.append(now_s)
        answer = self._answers(now_s)
        if isinstance(answer, Exception):
            raise answer
        await asyncio.sleep(answer)
        raise aiomqtt.MqttError("gone again")


def tried(answers: Callable[[float], float | Exception], seconds: float) -> tuple[list[float], list[str]]:
    """When a broker is tried, in virtual time and with the pauses of the daemon, and what the log tells of it."""

    async def main() -> list[float]:
        publisher = ScriptedBroker(answers)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await publisher.run()
        return publisher.tries_s

    with capture_logs() as logs:
        return run_virtual(main()), [f"{one['event']} {one['reason']}" for one in logs]


def test_a_broker_that_is_gone_for_an_hour_is_tried_ever_later_and_told_of_once() -> None:
    there_s = 120.0
    tries_s, told = tried(lambda now_s: aiomqtt.MqttError("refused") if now_s < 3600.0 else there_s, 3800.0)
    assert tries_s == [0.0, 1.0, 3.0, 7.0, 15.0, 31.0, *range(63, 3604, 60), 3603.0 + there_s + 1.0]
    assert told == ["mqtt.gone refused", "mqtt.gone gone again"]


def test_a_broker_that_is_there_for_moments_only_is_not_tried_faster_for_that() -> None:
    assert tried(lambda _now_s: 2.0, 20.0)[0] == [0.0, 3.0, 7.0, 13.0]


def test_an_error_of_our_own_is_told_and_ends_no_publishing() -> None:
    tries_s, told = tried(lambda _now_s: KeyError("what"), 4.0)
    assert (tries_s, told) == ([0.0, 1.0, 3.0], ["mqtt.failed KeyError('what')"])


def test_of_the_log_of_an_hour_the_newest_lines_are_told_oldest_first_and_once() -> None:
    station = Station()
    publisher = MqttPublisher(BrokerAddress("127.0.0.1", 1), TOPICS, station.sources())
    for number in range(3600):
        station.events.add({"event": "tick", "number": number, "level": "info"})
    *events, schedule, state = publisher._news()
    told = [json.loads(one.payload)["text"] for one in events]
    assert told == [f"number={number}" for number in range(3600 - KEPT, 3600)]
    assert (schedule.topic, state.topic) == ("site/dish/schedule", "site/dish/state")
    assert publisher._news() == []
    for number in (3600, 3601):
        station.events.add({"event": "tick", "number": number, "level": "info"})
    assert [json.loads(one.payload)["text"] for one in publisher._news()] == ["number=3600", "number=3601"]


@needs_mosquitto
@pytest.mark.realtime
async def test_user_and_password_are_given_and_wrong_ones_are_tried_again_in_peace(tmp_path: Path) -> None:
    port, station, file = free_port(), Station(), tmp_path / "users"
    subprocess.run(["mosquitto_passwd", "-b", "-c", str(file), "dish", "secret"], check=True, capture_output=True)
    file.chmod(0o644)
    more = f"allow_anonymous false\npassword_file {file}\nuser root\n"
    with mosquitto(tmp_path / "broker", port, more):
        async with published(station, port, user="dish", password="wrong") as refused:
            async with asyncio.timeout(PATIENCE_S):
                while "uthori" not in refused._said:
                    await asyncio.sleep(0.02)
            assert refused.connect_count == 0
        async with published(station, port, user="dish", password="secret") as publisher:
            async with listening(port, "site/#", username="dish", password="secret") as following:
                assert await following("site/dish/availability") == b"online"
            assert publisher.connect_count == 1


class Forgetful:
    """A broker that takes what is published and goes after each state; started again it has nothing."""

    taken: ClassVar[list[list[str]]] = []

    def __init__(self, *_: Any, **__: Any) -> None:
        self._client = SimpleNamespace(on_disconnect=None, disconnect=lambda: None)
        self.taken.append([])

    async def __aenter__(self) -> "Forgetful":
        return self

    async def __aexit__(self, *_: object) -> None:
        return

    async def publish(self, topic: str, *_: Any, **__: Any) -> None:
        self.taken[-1].append(topic)
        if topic.endswith("/state"):
            raise aiomqtt.MqttError("gone")


async def test_a_broker_that_was_started_again_is_told_everything_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mqtt_publisher.aiomqtt, "Client", Forgetful)
    monkeypatch.setattr(Forgetful, "taken", [])
    station = Station(passes=[{"satellite": "SCD-1"}])
    publisher = MqttPublisher(BrokerAddress("127.0.0.1", 1), TOPICS, station.sources(), (0.05, 0.2))
    for _ in range(2):
        with pytest.raises(aiomqtt.MqttError):
            await publisher._publish_until_gone()
    assert publisher.connect_count == 2
    before, again = Forgetful.taken
    assert before == again
    assert [topic for topic in again if topic.startswith(TOPICS.base)] == [
        f"{TOPICS.base}/{what}" for what in ("availability", "schedule", "state", "availability")
    ]


class Losing:
    """A client that loses the first cancellation, as asyncio.wait_for of Python 3.11 does when an answer comes."""

    to_lose: ClassVar[int] = 1

    def __init__(self, *_: Any, **__: Any) -> None:
        self._client = SimpleNamespace(on_disconnect=None, disconnect=lambda: None)

    async def __aenter__(self) -> "Losing":
        return self

    async def __aexit__(self, *_: object) -> None:
        return

    async def publish(self, *_: Any, **__: Any) -> None:
        try:
            await asyncio.sleep(3600.0)
        except asyncio.CancelledError:
            Losing.to_lose -= 1
            if Losing.to_lose < 0:
                raise


class Refused(Losing):
    async def __aenter__(self) -> "Losing":
        await self.publish()
        raise aiomqtt.MqttError("refused")


@pytest.mark.parametrize("client", [Losing, Refused])
async def test_an_end_that_comes_with_the_brokers_answer_is_not_lost(
    client: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt_publisher.aiomqtt, "Client", client)
    monkeypatch.setattr(Losing, "to_lose", 1)
    publisher = MqttPublisher(BrokerAddress("127.0.0.1", 1), TOPICS, Station().sources(), (0.05, 0.2))
    task = asyncio.create_task(publisher.run())
    await asyncio.sleep(0.01)
    task.cancel()
    done, _ = await asyncio.wait([task], timeout=2.0)
    assert done
    assert task.cancelled()


async def test_a_broker_that_takes_connections_and_says_nothing_keeps_nobody_waiting(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mqtt_publisher, "PATIENCE_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        port = mute.getsockname()[1]
        async with published(Station(), port) as publisher, asyncio.timeout(PATIENCE_S):
            while not publisher._said:
                await asyncio.sleep(0.02)
        assert publisher.connect_count == 0


@needs_mosquitto
@pytest.mark.realtime
async def test_a_daemon_that_is_killed_is_offline_by_its_will(tmp_path: Path) -> None:
    port, scene = free_port(), pass_rig.make_scene(tmp_path / "scene", None, 120.0)

    def wait_for(is_so: Callable[[], object]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not is_so():
            assert time.monotonic() < end_s
            time.sleep(0.05)

    with mosquitto(tmp_path / "broker", port), pass_rig.rigs(scene, ["tcp"], tmp_path) as [rig]:
        rig.start_acu()
        station = rig.config / "station.toml"
        station.write_text(station.read_text() + f'\n[mqtt]\nurl = "mqtt://127.0.0.1:{port}"\n')
        rig.start_daemon()
        await asyncio.to_thread(wait_for, lambda: rig.events("mqtt.connected"))
        async with listening(port, "acu-daemon/#") as following:
            assert await following("acu-daemon/availability") == b"online"
            assert json.loads(await following("acu-daemon/state"))["is_rehearsal"] is True
            assert "event" in json.loads(await following("acu-daemon/event"))
            rig.daemon.send_signal(signal.SIGKILL)
            assert await following("acu-daemon/availability") == b"offline"


async def test_without_a_station_the_schedule_is_the_pass_in_hand(tmp_path: Path) -> None:
    outlets = Outlets(demo_target().station, tmp_path, LoopClock(0.0))
    assert outlets._schedule() == []
    outlets.tally.seen = replace(SEEN, satellite="SCD-1", rise_utc="2026-01-01T00:00:00Z", next_passes=("X 12:00",))
    assert [one.get("satellite") or one["text"] for one in outlets._schedule()] == ["SCD-1", "X 12:00"]

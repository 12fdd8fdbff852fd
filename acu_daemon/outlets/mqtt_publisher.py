"""Keeps a connection to an MQTT broker and publishes what there is to see; without a broker nothing waits for one.

Only the newest state counts, so a broker that was gone for an hour is told that, and of the log what is still at hand.
"""

import asyncio
import contextlib
import ssl
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import aiomqtt
import structlog

from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.outlets.mqtt_messages import OFFLINE, ONLINE, MqttMessage, Topics, discovery

EVERY_S = 1.0
PATIENCE_S = 5.0  # with a broker that does not take a message
FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0
KEEPALIVE_S = 20
MOST_QUEUED = 200  # messages that the client holds at most


@dataclass(frozen=True, slots=True)
class BrokerAddress:
    """Where the broker is, and as whom it is spoken to.  discovery_prefix: of Home Assistant; empty: none."""

    host: str
    port: int
    is_tls: bool = False
    user: str | None = None
    password: str | None = None
    discovery_prefix: str = "homeassistant"


@dataclass(frozen=True, slots=True)
class MqttSources:
    """What is published: the newest snapshot, the log (how many lines so far, the newest ones first), the passes."""

    state: Callable[[], Snapshot | None]
    events: Callable[[], tuple[int, Callable[[], list[dict[str, str]]]]]
    schedule: Callable[[], list[Any]]


class MqttPublisher:
    """Owned by the loop.  `run` is its task."""

    def __init__(
        self,
        broker: BrokerAddress,
        topics: Topics,
        sources: MqttSources,
        pauses_s: tuple[float, float] = (FIRST_PAUSE_S, LONGEST_PAUSE_S),
    ) -> None:
        """pauses_s: before the first further try, and the longest."""
        self._broker, self._topics, self._sources = broker, topics, sources
        self._first_pause_s, self._longest_pause_s = pauses_s
        self._told_event_count = 0
        self._schedule: bytes | None = None
        self._state_tai_s = float("-inf")
        self._said = ""
        self._log: Any = structlog.get_logger("mqtt")
        self.connect_count = 0

    async def run(self) -> None:
        """Publish for ever; a broker that is gone is tried again, ever later, and told of once."""
        pause_s, loop = self._first_pause_s, asyncio.get_running_loop()
        while True:
            begun_s = loop.time()
            try:
                await self._publish_until_gone()
            except (aiomqtt.MqttError, OSError, ValueError) as error:
                self._tell(str(error) or type(error).__name__)
            except Exception as error:  # noqa: BLE001  the top of its own task
                self._tell_failed(repr(error))
            _heed_cancelling()
            if loop.time() - begun_s > self._longest_pause_s:
                pause_s = self._first_pause_s
            await asyncio.sleep(pause_s)
            pause_s = min(2.0 * pause_s, self._longest_pause_s)

    def _tell(self, reason: str) -> None:
        if reason != self._said:
            self._said = reason
            broker = f"{self._broker.host}:{self._broker.port}"
            self._log.warning("mqtt.gone", broker=broker, reason=reason)

    def _tell_failed(self, reason: str) -> None:
        if reason != self._said:
            self._said = reason
            self._log.error("mqtt.failed", reason=reason, advice="an error of ours: please report it")

    async def _publish_until_gone(self) -> None:
        broker, topics = self._broker, self._topics
        trust = await asyncio.to_thread(ssl.create_default_context) if broker.is_tls else None
        client = aiomqtt.Client(
            broker.host,
            broker.port,
            username=broker.user,
            password=broker.password,
            will=aiomqtt.Will(topics.availability, OFFLINE, qos=1, retain=True),
            tls_context=trust,
            timeout=PATIENCE_S,
            keepalive=KEEPALIVE_S,
            max_queued_outgoing_messages=MOST_QUEUED,
        )
        try:
            await self._publish_by(client)
        finally:
            _hang_up(client)

    async def _publish_by(self, client: aiomqtt.Client) -> None:
        broker, topics = self._broker, self._topics
        async with client:
            self.connect_count += 1
            self._said, self._schedule, self._state_tai_s = "", None, float("-inf")
            self._log.info("mqtt.connected", broker=f"{broker.host}:{broker.port}", topic=topics.base)
            await _publish(client, MqttMessage(topics.availability, ONLINE, is_retained=True))
            for one in discovery(topics, broker.discovery_prefix) if broker.discovery_prefix else ():
                await _publish(client, one)
            try:
                while True:
                    for one in self._news():
                        await _publish(client, one)
                    await asyncio.sleep(EVERY_S)
            finally:
                with contextlib.suppress(aiomqtt.MqttError):
                    await _publish(client, MqttMessage(topics.availability, OFFLINE, is_retained=True))

    def _news(self) -> list[MqttMessage]:
        """What is to be told since the last look."""
        found = []
        count, lines = self._sources.events()
        if new_count := count - self._told_event_count:
            self._told_event_count = count
            found += [self._topics.event(line) for line in reversed(lines()[:new_count])]
        schedule = self._topics.schedule(self._sources.schedule())
        if schedule.payload != self._schedule:
            self._schedule = schedule.payload
            found.append(schedule)
        seen = self._sources.state()
        if seen is not None and seen.tai_s != self._state_tai_s:
            self._state_tai_s = seen.tai_s
            found.append(self._topics.state(seen))
        return found


def _hang_up(client: aiomqtt.Client) -> None:
    """Close the connection to a broker that never said that it has taken us: aiomqtt itself leaves it open."""
    inner = client._client
    inner.on_disconnect = None
    inner.disconnect()


async def _publish(client: aiomqtt.Client, message: MqttMessage) -> None:
    await client.publish(message.topic, message.payload, qos=0, retain=message.is_retained, timeout=PATIENCE_S)
    _heed_cancelling()


def _heed_cancelling() -> None:
    """End a task that was told to: asyncio.wait_for of Python 3.11, in aiomqtt, loses it where the answer comes too."""
    task = asyncio.current_task()
    if task is not None and task.cancelling():
        raise asyncio.CancelledError

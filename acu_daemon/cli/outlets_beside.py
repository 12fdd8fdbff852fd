"""What of a daemon other programs see: one object for the process, through all its runs."""

import asyncio
import contextlib
import ipaddress
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from acu_daemon.cli.page import PageFrame
from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.lease import LASTS_S, Claim
from acu_daemon.control.tick_input import SlaveWish
from acu_daemon.daemon.operator_requests import tell
from acu_daemon.daemon.operator_verbs import VERBS, understood
from acu_daemon.daemon.service import Service
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.tally import Tally
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.secret_file import read_secret
from acu_daemon.errors import UsageError
from acu_daemon.schedule.wind import WindWatch

if TYPE_CHECKING:  # they take a third of a second to load, and most daemons have no use for them
    from acu_daemon.cli.led_antenna import LedAntenna
    from acu_daemon.outlets.metric_families import Surroundings
    from acu_daemon.outlets.metrics_server import MetricsServer
    from acu_daemon.outlets.rotctld_port import RotctldPort

LEASE_VERBS = ("grant", "revoke")
DISK_S = 30.0
Answer = Callable[[str, str], str]


class Outlets:
    """Owned by the loop.

    page: whose lease and log are shared; current: the run that goes on; of a station wind and passes; config: the
    directory beside which files are.  UsageError: of a password's file.
    """

    def __init__(
        self,
        station: StationFile,
        directory: Path,
        clock: Clock,
        page: PageFrame | None = None,
        current: Callable[[], Service | None] = lambda: None,
        wind: Callable[[], WindWatch] = WindWatch,
        passes: Callable[[], list[dict[str, Any]]] | None = None,
        config: Path = Path(),
    ) -> None:
        self.tally = Tally()
        self.lease = WriteLease(clock.monotonic_s) if page is None else page.lease
        self._page, self._passes = page, passes
        file = station.mqtt.password_file
        self._password = None if file is None else read_password(config / file)
        self._station, self._directory, self._wind = station, directory, wind
        self._clock, self._current = clock, current
        self._answer: Answer = lambda _line, _who: "error the daemon starts"
        self._antenna: LedAntenna | None = None
        self._rotctld: RotctldPort | None = None
        self._metrics: MetricsServer | None = None
        self._disk_free_bytes: int | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def open(self) -> None:
        """Begin to serve, what is configured; what cannot is told, and no reason not to track."""
        if (address := self._station.metrics.address) is not None:
            from acu_daemon.outlets.metrics_server import MetricsServer

            self._metrics = MetricsServer(self.tally, self._around)
            await self._metrics.open(*address)
            self._tasks.append(asyncio.create_task(self._watch_disk(), name="disk"))
        if (broker := self._station.mqtt.broker) is not None:
            self._publish(*broker)
        if (address := self._station.rotctld.address) is not None:
            from acu_daemon.cli.led_antenna import DaemonSeen, LedAntenna
            from acu_daemon.outlets.rotctld_port import RotctldPort

            seen = DaemonSeen(self.tally, self._clock, self._current, lambda line, who: self._answer(line, who))
            self._antenna = LedAntenna(self._station, seen)
            self._rotctld = RotctldPort(
                self._antenna,
                self.lease,
                self._clock.monotonic_s,
                may_anyone_stop=self._station.rotctld.stop == "anyone",
            )
            await self._rotctld.open(*address)

    def _publish(self, host: str, port: int, is_tls: bool) -> None:
        """Begin to publish."""
        from acu_daemon.outlets.mqtt_messages import Topics
        from acu_daemon.outlets.mqtt_publisher import BrokerAddress, MqttPublisher, MqttSources

        section = self._station.mqtt
        broker = BrokerAddress(host, port, is_tls, section.user, self._password, section.discovery_prefix)
        topics = Topics(section.topic, self._station.station.name)
        publisher = MqttPublisher(broker, topics, MqttSources(lambda: self.tally.seen, self._events, self._schedule))
        self._tasks.append(asyncio.create_task(publisher.run(), name="mqtt"))

    def _events(self) -> tuple[int, Callable[[], list[dict[str, str]]]]:
        """How many lines the log has had, and what has the newest of them."""
        return (0, list) if self._page is None else (self._page.events.count, self._page.events.lines)

    def _schedule(self) -> list[Any]:
        """The passes to come: of a station those of its schedule, else the one in hand and what is said of others."""
        if self._passes is not None:
            return self._passes()
        seen = self.tally.seen
        if seen is None or not seen.rise_utc:
            return []
        now = {"satellite": seen.satellite, "rise_utc": seen.rise_utc, "set_utc": seen.set_utc}
        return [now | {"culmination_deg": seen.culmination_deg}, *({"text": text} for text in seen.next_passes)]

    def see(self, _seen: Snapshot) -> None:
        """A tick is over, and this is to be seen; the tally has it already."""
        if self._rotctld is not None and self._antenna is not None:
            self._rotctld.look()
            self._antenna.look()
        if self._metrics is not None:
            self._metrics.ticked()

    @property
    def wish(self) -> SlaveWish | None:
        """What a program that has the lease wants of the antenna now; None: none leads it."""
        return None if self._antenna is None else self._antenna.wish

    def counted(self, answer: Answer) -> Answer:
        """What answers people's lines, with those counted that were obeyed."""

        def counting(line: str, who: str = "") -> str:
            verb = line.split(" ")[0]
            reply = (
                self._of_lease(line, who) if verb in LEASE_VERBS and self._rotctld is not None else answer(line, who)
            )
            if verb in VERBS and reply.startswith("ok"):
                self.tally.count("actions", f"{verb} {via_of(who)}")
            return reply

        self._answer = counting
        return counting

    def _of_lease(self, line: str, who: str) -> str:
        """Give the lease to a program's address, or take it back from whoever has it."""
        from acu_daemon.outlets.rotctld_port import key_of

        try:
            said = understood(line)
            if said.verb.name == "revoke":
                held = self.lease.held
                if held is not None:
                    self.lease.give_back(held.claim.key)
                whose = "nobody's" if held is None else f"that of {held.claim.name} by {held.claim.via}"
                return tell(line=line, who=who, answer=f"ok the lease was {whose}")
            address = str(ipaddress.ip_address(said.texts.get("to", "")))
        except (UsageError, ValueError) as error:
            return f"error {error}"
        lasts_s = said.figures.get("lasts_s", LASTS_S)
        claim = Claim(key_of(address), address, "rotctl", said.texts.get("name", ""), lasts_s)
        if refused := self.lease.take(claim, takes_over=said.texts.get("over") == "yes"):
            return tell(line=line, who=who, answer=f"error {refused}")
        return tell(
            line=line, who=who, answer=f"ok {address} may lead the antenna, until it is silent for {lasts_s:g} s"
        )

    def asked_for_elements(self, source: str, problem: str) -> None:
        """A server of elements was asked; problem: a word for why nothing good came, empty: it did."""
        self.tally.count("fetches", source)
        if problem:
            self.tally.count("fetches_failed", f"{source} {problem}")

    async def close(self) -> None:
        """End what is served."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._rotctld is not None:
            await self._rotctld.close()
        if self._metrics is not None:
            await self._metrics.close()

    def _around(self) -> "Surroundings":
        from acu_daemon.outlets.metric_families import Surroundings

        held, section, newest = self.lease.held, self._station.wind, self._wind().newest
        return Surroundings(
            lease_via="" if held is None else held.claim.via,
            wind_m_s=None if newest is None else (newest.mean_m_s, newest.gust_m_s),
            wind_limits_m_s=(section.mean_limit_m_s, section.gust_limit_m_s) if section.is_watched else None,
            disk_free_bytes=self._disk_free_bytes,
        )

    async def _watch_disk(self) -> None:
        """A disk may hang: it is asked beside the loop."""
        while True:
            with contextlib.suppress(OSError, RuntimeError):
                self._disk_free_bytes = (await asyncio.to_thread(shutil.disk_usage, self._directory)).free
            await asyncio.sleep(DISK_S)


def read_password(path: Path) -> str:
    """The password of a file that nobody else may read.  UsageError: says what to do."""
    key = "[mqtt] password_file"
    try:
        return read_secret(path, key).decode()
    except UnicodeDecodeError:
        raise UsageError(f"{key} {path}: expected UTF-8 text") from None


def via_of(who: str) -> str:
    """By which way a person's line came."""
    for via in ("page", "rotctl"):
        if f"by {via}" in who or who.startswith(via):
            return via
    return "cli"

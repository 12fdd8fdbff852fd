"""The seam between the daemon and the ACU's bytes, and the choice of the link by its URL (docs/configuration.md)."""

import math
import time
from collections.abc import Callable
from typing import Protocol
from urllib.parse import SplitResult, parse_qsl, urlsplit

from acu_daemon.acu.commands import PointAndPoll
from acu_daemon.acu.driver import AcuDriver
from acu_daemon.edge.serial_port import CHARACTER_FORMATS, SerialLink
from acu_daemon.edge.tcp import TcpLink
from acu_daemon.errors import LinkError, UsageError

BITS_PER_CHARACTER = 10  # start, 8N1 or 7E1, stop
DEFAULT_BAUD = 9600
BAUD_RATES = (1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
CYCLE_SHARE = 0.95  # of the period: docs/adding-an-acu.md, Timing
EXPECTED = "expected tcp://HOST:PORT, tcp://HOST:PORT?baud=9600 or serial:///dev/ttyUSB0?baud=9600&format=8N1"


class Link(Protocol):
    """A byte stream to the ACU.  One task opens, reads and closes; write never waits."""

    @property
    def description(self) -> str:
        """The link's URL, for people."""

    @property
    def byte_time_s(self) -> float:
        """Time a character spends on the wire; 0 where it is not known (TCP)."""

    async def open(self) -> None:
        """Open, or open again after close().  LinkError: cannot; LinkRefusedError: somebody else holds the ACU."""

    def write(self, data: bytes) -> None:
        """Send.  LinkError: the link is not open."""

    async def read(self, until_s: float = math.inf) -> tuple[bytes, float]:
        """Wait for the next chunk and its arrival time on the monotonic clock.

        LinkError: the link is dead.  TimeoutError: nothing has come until then, on the loop's clock.
        """
        ...

    def drain_input(self) -> bytes:
        """Take what has arrived and was not read.  LinkError: the link is not open."""
        ...

    async def close(self) -> None:
        """Close at once; does nothing on a closed link."""


def make_link(url: str, monotonic: Callable[[], float] = time.monotonic) -> Link:
    """Make the link a URL names, not yet open.  UsageError: the URL is not understood; says what is expected."""
    parts = urlsplit(url)
    if parts.scheme == "tcp":
        options = _options(url, parts, {"baud"})
        return TcpLink(*_host_and_port(url, parts), _byte_time_s(url, options), monotonic)
    if parts.scheme == "serial":
        options = _options(url, parts, {"baud", "format"})
        if parts.netloc or not parts.path.startswith("/"):
            raise UsageError(f"link {url!r}: the device path is not absolute; {EXPECTED}")
        character_format = options.get("format", "8N1")
        if character_format not in CHARACTER_FORMATS:
            raise UsageError(f"link {url!r}: format {character_format!r}, expected 8N1 or 7E1")
        return SerialLink(parts.path, _baud(url, options.get("baud", str(DEFAULT_BAUD))), character_format, monotonic)
    raise UsageError(f"link {url!r} is not understood; {EXPECTED}")


async def open_once(link: Link) -> None:
    """Open a link without the patience of a daemon: every address of its name has its try.  LinkError: none answers."""
    try_count = 0
    while True:
        try_count += 1
        try:
            return await link.open()
        except LinkError:
            if not isinstance(link, TcpLink) or try_count >= link.address_count:
                raise


def cycle_s(driver: AcuDriver, byte_time_s: float, latency_s: float) -> float:
    """Time of the normal cycle: angles are commanded and the status comes, an idle character, and the latency."""
    return (driver.wire_bytes(PointAndPoll(0.0, 0.0)) + 1) * byte_time_s + latency_s


def check_rate(link: Link, driver: AcuDriver, period_s: float, device_delay_s: float) -> None:
    """Check that the normal cycle fits the period.  UsageError: no, with the arithmetic."""
    needed_s = cycle_s(driver, link.byte_time_s, device_delay_s)
    allowed_s = CYCLE_SHARE * period_s
    if needed_s <= allowed_s:
        return
    character_count = driver.wire_bytes(PointAndPoll(0.0, 0.0)) + 1
    fastest_s = cycle_s(driver, BITS_PER_CHARACTER / max(BAUD_RATES), device_delay_s)
    advice = "use a higher baud rate or a longer period" if fastest_s <= allowed_s else "use a longer period"
    raise UsageError(
        f"{link.description} cannot carry a command and its status every {period_s * 1e3:g} ms: {character_count}"
        f" characters of {link.byte_time_s * 1e3:.3f} ms and {device_delay_s * 1e3:g} ms of device delay"
        f" make {needed_s * 1e3:.1f} ms, and only {allowed_s * 1e3:g} ms (95 % of the period) are allowed; {advice}"
    )


def _options(url: str, parts: SplitResult, allowed: set[str]) -> dict[str, str]:
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    if unknown := sorted(options.keys() - allowed):
        raise UsageError(f"link {url!r}: unknown option {unknown[0]!r}; {EXPECTED}")
    return options


def _host_and_port(url: str, parts: SplitResult) -> tuple[str, int]:
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if not host or not port or parts.path not in ("", "/"):
        raise UsageError(f"link {url!r}: host and port (1 to 65535) are needed; {EXPECTED}")
    return host, port


def _byte_time_s(url: str, options: dict[str, str]) -> float:
    return BITS_PER_CHARACTER / _baud(url, options["baud"]) if "baud" in options else 0.0


def _baud(url: str, text: str) -> int:
    if text not in map(str, BAUD_RATES):
        raise UsageError(f"link {url!r}: baud {text!r}, expected one of {', '.join(map(str, BAUD_RATES))}")
    return int(text)

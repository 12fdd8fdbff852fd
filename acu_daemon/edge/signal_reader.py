"""What a receiver says of the signal, in UDP datagrams: JSON, or a bare number of dB.

{"db": 12.5, "locked": true, "utc": "2026-08-18T12:00:00.5Z"}

Each of the three may be missing, but one of db and locked must be there.  Where several send to the address, one that
is locked counts before one that is not, then the strongest.
"""

import json
from math import inf
from typing import Any

import structlog

from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.edge.carry_over_file import reason_of
from acu_daemon.edge.newest_text import NewestText
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

LONGEST_BYTES = 1000
MOST_AHEAD_S = 1.0  # of our clock


def signal_of(text: bytes, now_tai_s: float, *, has_own_time: bool = True) -> SignalSample:
    """Read a datagram.  ValueError: what is wrong with it.

    has_own_time: the sender's clock is the daemon's; else, as in a rehearsal, it is of the time at which it came.
    """
    if len(text) > LONGEST_BYTES:
        raise ValueError(f"longer than {LONGEST_BYTES} bytes")
    try:
        said = json.loads(text)
        if not isinstance(said, dict):
            said = {"db": said}
        sample = SignalSample(_time(said, now_tai_s, has_own_time=has_own_time), _level(said), _locked(said))
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError, OverflowError) as error:
        raise ValueError(reason_of(error)) from None
    if not sample.is_possible:
        raise ValueError("expected a db that a level can be, or locked = true or false")
    if sample.tai_s > now_tai_s + MOST_AHEAD_S:
        raise ValueError(f"it is of {utc_text(sample.tai_s, 1)}, ahead of this clock")
    return sample


def _time(said: dict[str, Any], now_tai_s: float, *, has_own_time: bool) -> float:
    utc = said.get("utc")
    return tai_from_utc(utc) if utc is not None and has_own_time else now_tai_s


def _level(said: dict[str, Any]) -> float | None:
    value = said.get("db")
    if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
        raise ValueError(f"db = {value!r}: expected a number")
    return None if value is None else float(value)


def _locked(said: dict[str, Any]) -> bool | None:
    value = said.get("locked")
    if value is not None and not isinstance(value, bool):
        raise ValueError(f"locked = {value!r}: expected true or false")
    return value


class SignalReader:
    """Hands out the newest usable word.  Owned by the loop.  udp: ADDRESS:PORT of this machine."""

    def __init__(self, udp: str, *, has_own_time: bool = True) -> None:
        self._source = NewestText(udp, None)
        self._udp = udp
        self._has_own_time = has_own_time
        self._said = ""
        self._log: Any = structlog.get_logger("signal")

    async def open(self) -> None:
        """Listen; an address that cannot be had is told: nothing is known of the signal then."""
        if reason := await self._source.open():
            self._log.warning("signal.no_socket", address=self._udp, reason=reason)

    def close(self) -> None:
        self._source.close()

    def now(self, now_tai_s: float) -> SignalSample | None:
        """What came since the last look; None: nothing usable."""
        texts, _ = self._source.newest()
        found, said = [], ""
        for _, text in texts:
            try:
                found.append(signal_of(text, now_tai_s, has_own_time=self._has_own_time))
            except ValueError as error:
                said = str(error)
        if said and said != self._said:
            self._log.warning("signal.ignored", reason=said)
        if texts:
            self._said = said
        return max(found, key=_best, default=None)


def _best(sample: SignalSample) -> tuple[bool, float]:
    return bool(sample.is_locked), -inf if sample.level_db is None else sample.level_db

"""What people at a page may order, and what each order comes to: one line of the same verbs as the command line's.

STOP asks for nothing: no token, no lease, no unlocking.  All else is sealed with the token.  A verb asks for a page
that its user has unlocked, and that has the write lease; an alarm is acknowledged from a locked page too.
"""

import math
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import structlog

from acu_daemon.control.lease import Claim
from acu_daemon.daemon.operator_verbs import VERBS
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.web.guard import Allowance, Seals

UNLOCKED_S = 30.0
STOP_LINE = "stop"
MOST_VALUES = 8
_WORD = re.compile(r"[a-z][a-z0-9_]{0,30}")
_VALUE = re.compile(r"[A-Za-z0-9:+./_-]{1,60}")


@dataclass(slots=True)
class Person:
    """Somebody at a page.  Owned by its connection."""

    peer: str
    seals: Seals
    name: str = ""
    unlocked_until_s: float = -math.inf
    orders: Allowance = field(default_factory=lambda: Allowance.of(5.0, 20.0))
    stops: Allowance = field(default_factory=lambda: Allowance.of(5.0, 20.0))
    is_barred: bool = False  # too many orders with a wrong seal, or more stops than a hand can press

    @property
    def who(self) -> str:
        """For the log and for others."""
        return f"{self.name or 'somebody'} by page from {self.peer}"

    @property
    def key(self) -> str:
        """Whose lease it is: that of the same person after the page was loaded again."""
        return f"page {self.name} {self.peer}"


class OrderDesk:
    """Takes orders.  Owned by the loop.  answer: does a line and says what came of it, at once."""

    def __init__(
        self,
        answer: Callable[[str, str], str],
        lease: WriteLease,
        now_s: Callable[[], float],
        acknowledge: Callable[[int, str], None],
    ) -> None:
        self._answer, self._lease, self._now_s, self._acknowledge = answer, lease, now_s, acknowledge
        self._log: Any = structlog.get_logger("page")
        self._wrong = Allowance.of(0.1, 10.0)  # of all connections together
        self._told = Allowance.of(1.0, 10.0)

    def stop(self, person: Person) -> str:
        """Stop the antenna, whoever asks; every one is obeyed, and after more than a hand can press the line is cut."""
        person.is_barred |= not person.stops.take(self._now_s())
        return self._answer(STOP_LINE, person.who)

    def take(self, person: Person, order: Any, seal: Any) -> dict[str, Any]:
        """Take a sealed order; what is replied to the page."""
        if not person.orders.take(self._now_s()):
            return _no("too many orders: wait a second")
        said, why = person.seals.open(order, seal)
        if said is None:
            if not self._wrong.take(self._now_s()):
                person.is_barred = True
            self._refused(person, why)
            return _no(why)
        reply = self._do(person, said)
        return reply | {"id": said.get("id")}

    def _do(self, person: Person, said: dict[str, Any]) -> dict[str, Any]:
        match said.get("do"):
            case "unlock":
                return self._unlock(person, said)
            case "lock":
                person.unlocked_until_s = -math.inf
                self._lease.give_back(person.key)
                return _yes("locked")
            case "acknowledge" if type(said.get("number")) is int:  # true is none
                self._acknowledge(said["number"], person.who)
                self._log.info("alarm.acknowledged", number=said["number"], who=person.who)
                return _yes("seen")
            case "verb":
                return self._verb(person, said)
        return _no("this order is unknown")

    def _unlock(self, person: Person, said: dict[str, Any]) -> dict[str, Any]:
        name = Claim("", str(said.get("name", "")), "page").name
        if not name:
            return _no("say who you are: others see who has the lease")
        person.name = name
        claim = Claim(person.key, name, "page", str(said.get("reason", "")))
        if why := self._lease.take(claim, takes_over=said.get("takes_over") is True):
            return _no(why) | {"is_held": True}
        return self._unlocked(person, "unlocked")

    def _verb(self, person: Person, said: dict[str, Any]) -> dict[str, Any]:
        line = line_of(said)
        if line is None:
            return _no("this verb is not written so")
        if self._now_s() >= person.unlocked_until_s:
            return _no("the page is locked: unlock it first") | {"is_locked": True}
        if not self._lease.use(person.key):
            return _no("somebody else has the lease, or yours is over: unlock again") | {"is_locked": True}
        answer = self._answer(line, person.who)
        verdict, _, text = answer.partition(" ")
        return self._unlocked(person, text) if verdict == "ok" else _no(text)

    def _unlocked(self, person: Person, text: str) -> dict[str, Any]:
        person.unlocked_until_s = self._now_s() + UNLOCKED_S
        return _yes(text) | {"unlocked_s": UNLOCKED_S}

    def _refused(self, person: Person, why: str) -> None:
        if self._told.take(self._now_s()):
            self._log.warning("page.refused", who=person.who, reason=why)


def verbs_shown(*, is_station: bool) -> list[dict[str, Any]]:
    """What may be ordered, for the page's buttons; STOP has one of its own."""
    return [
        asdict(verb) for verb in VERBS.values() if verb.name != STOP_LINE and (is_station or not verb.is_of_station)
    ]


def line_of(said: dict[str, Any]) -> str | None:
    """The line of a verb with its values, `VERB [KEY=VALUE ...]`; None where anything of it could be read otherwise."""
    verb, values = said.get("verb"), said.get("values", {})
    if not isinstance(verb, str) or not _WORD.fullmatch(verb) or not isinstance(values, dict):
        return None
    if len(values) > MOST_VALUES or not all(isinstance(key, str) and _WORD.fullmatch(key) for key in values):
        return None
    texts = {key: _text(value) for key, value in values.items()}
    if not all(_VALUE.fullmatch(text) for text in texts.values()):
        return None
    return " ".join([verb, *(f"{key}={text}" for key, text in texts.items())])


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _yes(text: str) -> dict[str, Any]:
    return {"ok": True, "text": text}


def _no(text: str) -> dict[str, Any]:
    return {"ok": False, "text": text}

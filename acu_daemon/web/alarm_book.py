"""The alarms as people have seen them: when each began and ended, and who acknowledged it.  Pure.

Acknowledging says that somebody has seen an alarm.  It clears nothing: the alarm stands until its cause is gone.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

KEPT = 40  # that are over
_NUMBERS = re.compile(r"[-+]?\d+(\.\d+)?")


@dataclass(frozen=True, slots=True)
class SeenAlarm:
    """One alarm; times are UTC texts, the end empty while it lasts."""

    number: int
    text: str
    began_utc: str
    ended_utc: str = ""
    acknowledged_by: str = ""


AlarmBook = tuple[SeenAlarm, ...]


def seen(book: AlarmBook, texts: Sequence[str], utc: str) -> AlarmBook:
    """The book after a look at the alarms of now.  The same words with other numbers are the same alarm."""
    kinds = {_kind(text): text for text in texts}
    kept: list[SeenAlarm] = []
    for one in book:
        text = kinds.pop(_kind(one.text), None) if not one.ended_utc else None
        if text is not None:
            kept.append(replace(one, text=text) if text != one.text else one)
        else:
            kept.append(one if one.ended_utc else replace(one, ended_utc=utc))
    number = max((one.number for one in book), default=0)
    for text in kinds.values():
        number += 1
        kept.append(SeenAlarm(number, text, utc))
    over = [one.number for one in kept if one.ended_utc and one.acknowledged_by]
    over += [one.number for one in kept if one.ended_utc and not one.acknowledged_by]
    gone = set(over[: max(0, len(over) - KEPT)])
    left = tuple(one for one in kept if one.number not in gone)
    return book if left == book else left


def acknowledged(book: AlarmBook, number: int, by: str) -> AlarmBook:
    """Somebody has seen one; it stays."""
    return tuple(
        replace(one, acknowledged_by=by) if one.number == number and not one.acknowledged_by else one for one in book
    )


def in_order(book: AlarmBook) -> list[SeenAlarm]:
    """Those not yet acknowledged first, of them those that last; then the newest."""
    return sorted(book, key=lambda one: (bool(one.acknowledged_by), bool(one.ended_utc), -one.number))


def _kind(text: str) -> str:
    return _NUMBERS.sub("#", text)

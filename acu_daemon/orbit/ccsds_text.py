"""Lines of a CCSDS message in keyword = value notation (KVN): ASCII, no line too long.  Pure."""

import re
import unicodedata
from collections.abc import Iterable, Iterator
from textwrap import wrap

from acu_daemon.orbit.timescales import utc_text

MOST_CHARACTERS = 254  # of a line: CCSDS 503.0-B-2, 4.2.3
_COMMENT_CHARACTERS = 100
_PLAIN = re.compile(r"[^ -~]")


def ascii_text(text: str) -> str:
    """The same in printable ASCII; accents are left out, what has no letter becomes "?"."""
    plain = unicodedata.normalize("NFKD", text)
    plain = "".join(one for one in plain if not unicodedata.combining(one))
    return _PLAIN.sub("?", plain).strip()


def field(keyword: str, value: str) -> str:
    """One line."""
    return f"{keyword} = {ascii_text(value)}"[:MOST_CHARACTERS]


def comments(texts: Iterable[str]) -> Iterator[str]:
    """Comment lines, wrapped."""
    for text in texts:
        yield from (f"COMMENT {line}" for line in wrap(ascii_text(text), _COMMENT_CHARACTERS))


def time_text(tai_s: float, digits: int = 6) -> str:
    """UTC without a Z, as messages have it."""
    return utc_text(tai_s, digits).removesuffix("Z")


def joined(lines: Iterable[str]) -> str:
    """The text of a message."""
    return "\n".join(lines) + "\n"

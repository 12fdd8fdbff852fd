"""The place of an ACU: one name for all ways to write its URL, and a name for files that is of no other one."""

import re
import socket
from hashlib import sha256
from pathlib import Path
from urllib.parse import urlsplit

EVERY_HOST = "*"  # of one who serves on all addresses of this machine
LOOPBACK = "127.0.0.1"
_LOOPBACKS = frozenset({"localhost", "::1", "ip6-localhost", LOOPBACK})
_WILDCARDS = frozenset({"0.0.0.0", "::", EVERY_HOST})
_LONGEST_WORD = 40
_HASH_DIGITS = 8


def place_of(url: str) -> str:
    """The place without what says only how to talk there: baud rate, format, another name for this machine."""
    parts = urlsplit(url)
    if parts.scheme != "tcp":
        path = Path(parts.path)
        return f"serial://{path.parent.resolve() / path.name}"
    host = (parts.hostname or "").rstrip(".")
    host = LOOPBACK if host in _LOOPBACKS else EVERY_HOST if host in _WILDCARDS else host
    return f"tcp://{host}:{parts.port}"


def places_of(url: str) -> list[str]:
    """The place, and where its host is this machine also that of one who serves on all its addresses."""
    place = place_of(url)
    parts = urlsplit(place)
    if parts.scheme == "tcp" and parts.hostname != EVERY_HOST and _is_of_this_machine(parts.hostname or ""):
        return [place, f"tcp://{EVERY_HOST}:{parts.port}"]
    return [place]


def file_name(text: str) -> str:
    """A name for files: readable, and different for different texts."""
    words = re.sub(r"[^\w.]+", "-", text, flags=re.ASCII).strip("-.")[:_LONGEST_WORD]
    return f"{words}-{sha256(text.encode()).hexdigest()[:_HASH_DIGITS]}".lstrip("-")


def _is_of_this_machine(host: str) -> bool:
    """Only the addresses of this machine can be bound; a name is not looked up, since that may take long."""
    if host == socket.gethostname().lower():
        return True
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        socket.inet_pton(family, host)
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((host, 0))
    except OSError:
        return False
    return True

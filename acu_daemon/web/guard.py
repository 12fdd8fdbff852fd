"""Who may ask the page for what: host and origin, the token and its seal, how often.  Pure but for the token's file.

A page of another site can make a browser send requests here, and by rebinding its name even as its own: so the Host
must be an address or a name of ours, and the Origin that same place.  An address cannot be rebound.

The token never crosses the line.  Each connection is given a nonce, and every order is sealed with
HMAC-SHA256(token, nonce + newline + order); an order counts up, so that none is taken twice, nor on another connection.
"""

import hashlib
import hmac
import ipaddress
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from acu_daemon.edge.secret_file import read_secret
from acu_daemon.errors import UsageError

LEAST_TOKEN = 16  # characters
LOCAL = "localhost"


def host_name(host: str) -> str:
    """The name or address of a Host header, without its port; empty: it is none."""
    try:
        return (urlsplit(f"//{host}").hostname or "").rstrip(".")
    except ValueError:
        return ""


def is_our_host(host: str, names: frozenset[str]) -> bool:
    """Whether a Host header names an address, localhost or one of our names."""
    name = host_name(host)
    if name == LOCAL or name in names:
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_our_origin(origin: str, host: str) -> bool:
    """Whether an Origin header is the place that the Host header names."""
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and bool(parts.netloc) and parts.netloc.lower() == host.lower()


def read_token(path: Path) -> bytes:
    """The token of a file that nobody else may read.  UsageError: says what to do."""
    token = read_secret(path, "[web] token_file", f"(umask 077; openssl rand -hex 16 > {path})")
    if len(token) < LEAST_TOKEN:
        raise UsageError(f"[web] token_file {path}: expected at least {LEAST_TOKEN} characters")
    return token


def seal_of(token: bytes, nonce: str, order: str) -> str:
    """What an order is sealed with."""
    return hmac.new(token, f"{nonce}\n{order}".encode("utf-8", "surrogatepass"), hashlib.sha256).hexdigest()


@dataclass(slots=True)
class Seals:
    """The orders of one connection.  Owned by it.  token None: nobody has one, and nothing is taken."""

    token: bytes | None
    nonce: str
    newest: int = 0  # number of the newest order

    def open(self, order: Any, seal: Any) -> tuple[dict[str, Any] | None, str]:
        """The order, or why it is refused."""
        if self.token is None:
            return None, "this page only looks: station.toml names no [web] token_file"
        if not isinstance(order, str) or not isinstance(seal, str):
            return None, "an order and its seal are texts"
        wanted = seal_of(self.token, self.nonce, order)
        if not hmac.compare_digest(wanted.encode(), seal.encode("utf-8", "replace")):
            return None, "the token is wrong"
        try:
            said = json.loads(order)
        except ValueError:
            return None, "the order is no JSON"
        number = said.get("n") if isinstance(said, dict) else None
        if type(number) is not int or number <= self.newest:
            return None, "this order was given before"
        self.newest = number
        return said, ""


@dataclass(slots=True)
class Allowance:
    """So many at once, and so many a second after that.  Owned by whoever asks it."""

    per_s: float
    most: float
    left: float
    at_s: float = 0.0

    @staticmethod
    def of(per_s: float, most: float) -> "Allowance":
        return Allowance(per_s, most, most)

    def take(self, now_s: float) -> bool:
        """Whether one more is allowed."""
        self.left = min(self.most, self.left + self.per_s * max(0.0, now_s - self.at_s))
        self.at_s = now_s
        if self.left < 1.0:
            return False
        self.left -= 1.0
        return True

    def wait_s(self) -> float:
        """How long until one is allowed again, after a refusal."""
        return (1.0 - self.left) / self.per_s

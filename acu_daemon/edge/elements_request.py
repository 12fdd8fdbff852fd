"""Asks a server of elements once, over HTTP or HTTPS: nothing is followed, nothing is tried twice.

Loaded by the process that fetches alone: aiohttp takes a third of a second to load, and the daemon has no use for it.
"""

import asyncio
import json
import ssl
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from pathlib import Path
from urllib.parse import urlsplit

import aiohttp

from acu_daemon import __version__
from acu_daemon.config.load import read_toml
from acu_daemon.edge.fetch_policy import Came, FetchOutcome, FetchState
from acu_daemon.errors import ConfigError

MOST_BYTES = 64 * 2**20  # of an answer, unpacked; a full catalogue is 7 MB as JSON
CHUNK_BYTES = 2**16
QUERIES_WITH_LOGIN = "/basicspacedata/"  # of Space-Track: the path of its queries, and where one logs in with a query
LOGIN_PATH = "/ajaxauth/login"
_HEADERS = {"User-Agent": f"acu-daemon/{__version__}", "Accept": "*/*"}


@dataclass(frozen=True, slots=True)
class Patience:
    """How long a server may take: for all of an answer, to be reached, between two pieces."""

    total_s: float = 120.0
    connect_s: float = 20.0
    pause_s: float = 30.0


@dataclass(frozen=True, slots=True)
class Login:
    """As whom Space-Track is asked."""

    identity: str
    password: str


def read_login(path: Path) -> Login:
    """ConfigError: the file cannot be used, or others may read it."""
    values = read_toml(path, 'identity = "..." and password = "..."')
    if set(values) != {"identity", "password"} or not all(isinstance(one, str) for one in values.values()):
        raise ConfigError(f'{path}: expected identity = "..." and password = "...", and nothing else')
    if path.stat().st_mode & 0o077:
        raise ConfigError(f"{path}: others may read the password: chmod 600 {path}")
    return Login(**values)


def trust(ca_file: Path | None) -> ssl.SSLContext:
    """The certificates of the system, and those of a file.  ConfigError: it cannot be read."""
    context = ssl.create_default_context()
    if ca_file is not None:
        try:
            context.load_verify_locations(cafile=ca_file)
        except (OSError, ssl.SSLError) as error:
            raise ConfigError(f"{ca_file}: certificates in PEM were expected: {error}") from None
    return context


async def ask_server(
    state: FetchState,
    now_unix_s: float,
    patience: Patience = Patience(),
    *,
    trusted: ssl.SSLContext,
    login: Login | None = None,
    most_bytes: int = MOST_BYTES,
) -> tuple[FetchOutcome, bytes]:
    """Ask for a group; the answer is not looked at beyond its size.  state: of before, for If-Modified-Since."""
    timeout = aiohttp.ClientTimeout(
        total=patience.total_s, sock_connect=patience.connect_s, connect=patience.connect_s, sock_read=patience.pause_s
    )
    connector = aiohttp.TCPConnector(ssl=trusted, force_close=True)
    try:
        async with (
            aiohttp.ClientSession(timeout=timeout, connector=connector, trust_env=True, headers=_HEADERS) as session,
            _request(session, state, login) as answer,
        ):
            return await _taken(answer, now_unix_s, most_bytes)
    except TimeoutError:
        return FetchOutcome(Came.FAILED, f"no answer, or no whole one, within {patience.total_s:g} s"), b""
    except aiohttp.ClientConnectorDNSError:
        return FetchOutcome(Came.FAILED, f"{urlsplit(state.url).hostname}: no such host, or no network"), b""
    except (aiohttp.ClientSSLError, ssl.SSLError) as error:
        return FetchOutcome(Came.FAILED, f"TLS: {_words(error)}"), b""
    except aiohttp.ClientPayloadError:
        return FetchOutcome(Came.FAILED, "the answer was cut"), b""
    except (aiohttp.ClientError, OSError, asyncio.IncompleteReadError, ValueError) as error:
        return FetchOutcome(Came.FAILED, _words(error)), b""


def _request(
    session: aiohttp.ClientSession, state: FetchState, login: Login | None
) -> "aiohttp.client._RequestContextManager":
    parts = urlsplit(state.url)
    if login is not None and QUERIES_WITH_LOGIN in parts.path:
        form = {"identity": login.identity, "password": login.password, "query": state.url}
        return session.post(f"{parts.scheme}://{parts.netloc}{LOGIN_PATH}", data=form, allow_redirects=False)
    conditions = {"If-Modified-Since": state.last_modified, "If-None-Match": state.etag}
    headers = {key: value for key, value in conditions.items() if value}
    return session.get(state.url, headers=headers, allow_redirects=False)


async def _taken(answer: aiohttp.ClientResponse, now_unix_s: float, most_bytes: int) -> tuple[FetchOutcome, bytes]:
    status = answer.status
    if status == 304:
        return FetchOutcome(Came.UNCHANGED), b""
    if status != 200:
        said = await _quoted(answer)
        if 300 <= status < 500:
            to = f", sends to {answer.headers['Location'][:200]}" if "Location" in answer.headers else ""
            return FetchOutcome(Came.REFUSED, f"HTTP {status} {answer.reason or ''}".rstrip() + to + said), b""
        retry_after_s = _retry_after_s(answer.headers.get("Retry-After", ""), now_unix_s)
        return FetchOutcome(
            Came.FAILED, f"HTTP {status} {answer.reason or ''}".rstrip() + said, retry_after_s=retry_after_s
        ), b""
    too_much = FetchOutcome(Came.UNUSABLE, f"more than {most_bytes / 2**20:.3g} MB: no group of elements is so large")
    if (answer.content_length or 0) > most_bytes:
        return too_much, b""
    data = bytearray()
    async for piece in answer.content.iter_chunked(CHUNK_BYTES):
        data += piece
        if len(data) > most_bytes:
            return too_much, b""
    if _is_failed_login(bytes(data[:200])):
        return FetchOutcome(Came.REFUSED, "the login is refused: look at identity and password"), b""
    last_modified, etag = (answer.headers.get(key, "")[:200] for key in ("Last-Modified", "ETag"))
    return FetchOutcome(Came.GOOD, last_modified=last_modified, etag=etag), bytes(data)


async def _quoted(answer: aiohttp.ClientResponse) -> str:
    """The first words of what a server says beside its refusal; CelesTrak says there what one did wrong."""
    start = await answer.content.read(400)
    words = _plain(start.decode("utf-8", "replace"))
    return f": {words[:160]!r}" if words and not words.startswith("<") else ""


def _is_failed_login(start: bytes) -> bool:
    try:
        said = json.loads(start)
    except ValueError:
        return False
    return isinstance(said, dict) and str(said.get("Login", "")).lower() == "failed"


def _retry_after_s(text: str, now_unix_s: float) -> float:
    """Seconds, or a date; 0 where it says nothing that can be read."""
    if text.strip().isdigit():
        return float(text)
    try:
        at = parsedate_to_datetime(text)
    except ValueError:
        return 0.0
    at = at.replace(tzinfo=UTC) if at.tzinfo is None else at
    return max(0.0, (at - datetime.fromtimestamp(now_unix_s, UTC)).total_seconds())


def _words(error: BaseException) -> str:
    """An error in one line, without what changes from time to time, so that it is told once."""
    return _plain(str(error)).replace(" ssl:default", "")[:300] or type(error).__name__


def _plain(text: str) -> str:
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())

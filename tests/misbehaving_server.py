"""A server of elements on this machine that answers as it is told: rightly, or in one of the ways that servers fail."""

import asyncio
import gzip
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from email.utils import format_datetime

PAGE = b"<!DOCTYPE html><html><head><title>Maintenance</title></head><body>back soon</body></html>"
LAST_MODIFIED = format_datetime(datetime(2026, 11, 30, 12, 0, 0, tzinfo=UTC), usegmt=True)
SO_MUCH = 2**20


def response(status: str, body: bytes = b"", *headers: str, length: int | None = None) -> bytes:
    """A whole answer; length: what the header says, where that is not the truth."""
    lines = [f"HTTP/1.1 {status}", f"Content-Length: {len(body) if length is None else length}", *headers]
    return "\r\n".join([*lines, "Connection: close", "", ""]).encode() + body


def good(body: bytes, *headers: str) -> bytes:
    return response("200 OK", body, f"Last-Modified: {LAST_MODIFIED}", *headers)


@dataclass
class Server:
    """What the server answers, and what it was asked.  hangs: it never answers.  is_blunt: it does not listen."""

    answer: bytes
    hangs: bool = False
    is_blunt: bool = False
    url: str = ""
    requests: list[bytes] = field(default_factory=list)

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            if self.is_blunt:
                writer.write(self.answer)
                await writer.drain()
                return
            request = await reader.readuntil(b"\r\n\r\n")
            if b"Content-Length: " in request:
                request += await reader.readexactly(int(request.split(b"Content-Length: ")[1].split(b"\r\n")[0]))
            self.requests.append(request)
            if self.hangs:
                await reader.read()  # until the other side gives up
            elif b"If-Modified-Since: " + LAST_MODIFIED.encode() in request and self.answer.startswith(b"HTTP/1.1 200"):
                writer.write(response("304 Not Modified") if LAST_MODIFIED.encode() in self.answer else self.answer)
            else:
                writer.write(self.answer)
            await writer.drain()
        except (OSError, EOFError, asyncio.IncompleteReadError):
            pass  # the other side has had enough
        finally:
            writer.close()


@asynccontextmanager
async def serving(answer: bytes, tls: ssl.SSLContext | None = None) -> AsyncIterator[Server]:
    """A server at a free port."""
    server = Server(answer)
    listening = await asyncio.start_server(server.serve, "127.0.0.1", 0, ssl=tls)
    port = listening.sockets[0].getsockname()[1]
    server.url = f"{'https' if tls else 'http'}://127.0.0.1:{port}/group.json"
    try:
        yield server
    finally:
        listening.close()


def misbehaviours(body: bytes, older: bytes, others: bytes) -> dict[str, tuple[bytes, str, str]]:
    """Name: the answer, what is made of it, words of the reason.  body: a good answer that would be newer."""
    return {
        "404": (response("404 Not Found", b"No such group"), "refused", "HTTP 404 Not Found: 'No such group'"),
        "301": (
            response("301 Moved Permanently", b"", "Location: https://elsewhere.example/gp"),
            "refused",
            "HTTP 301 Moved Permanently, sends to https://elsewhere.example/gp",
        ),
        "503": (response("503 Service Unavailable", PAGE), "failed", "HTTP 503 Service Unavailable"),
        "slow": (b"", "failed", "no answer, or no whole one, within"),
        "cut": (response("200 OK", body[: len(body) // 2], length=len(body)), "failed", "the answer was cut"),
        "HTML": (response("200 OK", PAGE), "unusable", "a web page, not elements: 'Maintenance back soon'"),
        "gzip": (response("200 OK", gzip.compress(body)), "unusable", "packed by gzip without saying so"),
        "older set": (
            response("200 OK", older),
            "unusable",
            "nothing better in it: ISS (25544): older than what is kept",
        ),
        "wrong satellite": (
            response("200 OK", others),
            "unusable",
            "none of this station's satellites in it (ISS (25544))",
        ),
        "empty": (response("200 OK"), "unusable", "the file is empty"),
        "huge": (response("200 OK", body + b" " * 3 * SO_MUCH), "unusable", "more than 1 MB"),
        "TLS error": (response("200 OK", body), "failed", "TLS: "),
    }

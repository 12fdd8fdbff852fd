"""SIMULATION: faults live, over a control port: one line in, one line out (`help` answers with several)."""

import asyncio
import contextlib
from collections.abc import AsyncIterator

from acu_daemon.errors import UsageError
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import VERBS, FaultError, parse_fault, vocabulary

MAX_LINE_BYTES = 1024
HELP = """\
fault VERB [start_s=S] [duration_s=S] [count=N] [probability=P] [value=V] [axis=azimuth|elevation|both] \
[on=reply|command] [seed=N]
list           what is planned or present
clear [N|VERB] end all faults, one, or those of a verb
help           this
"""


def answer_line(board: FaultBoard, line: str) -> str:
    """Obey one line of the control port; the answer begins with ok or error."""
    word, _, rest = line.strip().partition(" ")
    rest = rest.strip()
    try:
        match word:
            case "fault" if rest:
                return f"ok {board.add(parse_fault(rest))}"
            case "list" if not rest:
                return "ok " + ("; ".join(board.lines()) or "none")
            case "clear":
                return _clear(board, rest)
            case "help":
                return f"ok\n{HELP}{vocabulary()}\n"
    except FaultError as error:
        return f"error {error}"
    return f"error {line.strip()!r}: expected fault VERB [KEY=VALUE ...], list, clear [N|VERB] or help"


def _clear(board: FaultBoard, what: str) -> str:
    if not what:
        return f"ok {board.clear()} cleared"
    for verb in VERBS:
        if what == verb:
            return f"ok {board.clear(verb)} cleared"
    if what.isdecimal() and board.clear(int(what)):
        return "ok 1 cleared"
    return f"error there is no fault {what!r}; list shows those there are"


@contextlib.asynccontextmanager
async def serve_control(board: FaultBoard, host: str, port: int) -> AsyncIterator[str]:
    """Serve the control port; yields HOST:PORT (port 0: any free one).  UsageError: cannot listen."""

    async def speak(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError, ValueError, asyncio.IncompleteReadError):  # gone, or an endless line
            while line := await reader.readline():
                writer.write(answer_line(board, line.decode("ascii", "replace")).encode() + b"\n")
                await writer.drain()
        writer.close()

    try:
        server = await asyncio.start_server(speak, host, port, limit=MAX_LINE_BYTES)
    except OSError as error:
        raise UsageError(f"--control: cannot listen on {host}:{port}: {error.strerror or error}") from None
    try:
        yield f"{host}:{server.sockets[0].getsockname()[1]}"
    finally:
        server.close()

"""structlog: JSON lines to standard output for a service, readable lines for a terminal.  Changes, not ticks."""

import asyncio
import logging
import sys
from collections.abc import Callable, Mapping, MutableMapping
from functools import partial
from typing import Any

import structlog

from acu_daemon.edge.denied import denied
from acu_daemon.edge.state_directory import with_choice
from acu_daemon.edge.writer import Writer, write_text
from acu_daemon.orbit.timescales import utc_text

Entry = MutableMapping[str, Any]


def configure_logs(
    now_tai_s: Callable[[], float],
    *,
    tags: dict[str, Any],
    is_terminal: bool,
    is_debug: bool = False,
    before_line: Callable[[], None] | None = None,
    writer: Writer | None = None,
    choice: str = "",
    on_line: Callable[[Mapping[str, Any]], None] | None = None,
) -> None:
    """Set up the logs once.

    now_tai_s stamps every line with the daemon's own UTC; tags (SIMULATION, REHEARSAL) stand on every line; is_debug
    adds a line for each tick and fit; before_line clears the live line of a terminal first; writer prints the lines
    beside the loop; on_line sees each; choice: the options by which the commands that lines advise find this
    daemon.
    """

    def stamp(_logger: Any, _name: str, entry: Entry) -> Entry:
        said = {key: with_choice(value, choice) if isinstance(value, str) else value for key, value in entry.items()}
        line = {"utc": utc_text(now_tai_s()), **said, **tags}
        if on_line is not None:
            on_line(line)
        return line

    def readable(_logger: Any, name: str, entry: Entry) -> str:
        if before_line is not None:
            before_line()
        return _readable(name, entry)

    render: Any = readable if is_terminal else structlog.processors.JSONRenderer(default=str)
    structlog.configure(
        processors=[structlog.processors.add_log_level, stamp, render],
        wrapper_class=structlog.make_filtering_bound_logger(logging.DEBUG if is_debug else logging.INFO),
        logger_factory=_OutputFactory(writer),
        cache_logger_on_first_use=False,
    )


def tell_dropped(count: int) -> None:
    """Say that lines are missing from the log."""
    structlog.get_logger("log").warning("log.dropped", count=count, reason="the log's reader did not keep up")


def tell_signal(name: str) -> None:
    """Say that a signal came which means nothing here."""
    log: Any = structlog.get_logger("run")
    log.warning("signal.ignored", signal=name, advice="`acu-daemon status` asks, `disarm` and SIGTERM stop")


def tell_loop_problem(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Say what a callback of the loop could not do; with all we know where it is an error of ours."""
    error = context.get("exception")
    if words := denied(error) if error is not None else "":
        structlog.get_logger("run").error("system.denied", what=context["message"], reason=words)
    else:
        loop.default_exception_handler(context)


class _Output:
    """Prints lines to standard output.  A reader that went away, or a full disk, costs the line and never the pass."""

    def __init__(self, writer: Writer | None) -> None:
        self._writer = writer

    def msg(self, line: str) -> None:
        if self._writer is None:
            write_text(sys.stdout, line + "\n")
        else:
            self._writer.put(partial(write_text, sys.stdout, line + "\n"))

    debug = info = warning = error = critical = msg


class _OutputFactory:
    """Makes the one output; the names that loggers are asked for are not printed."""

    def __init__(self, writer: Writer | None) -> None:
        self._output = _Output(writer)

    def __call__(self, *_names: Any) -> _Output:
        return self._output


def _readable(level: str, entry: Entry) -> str:
    utc, event = str(entry.pop("utc")), str(entry.pop("event"))
    entry.pop("level", None)
    mark = {"warning": "!", "error": "!!"}.get(level, " ")
    shown = [f"{key}={_short(value)}" for key, value in entry.items() if value is not True]
    shown += [key for key, value in entry.items() if value is True]
    return f"{utc[11:21]} {mark:2} {event:20} {'  '.join(shown)}"


def _short(value: Any) -> str:
    """What a terminal takes for an order, such as in the name of a satellite, is shown and not obeyed."""
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return text if text.isprintable() else repr(text)[1:-1]

"""Signals (signal(7)): which of them end a run, which are only told, and what holds until the loop can take them.

A signal that whoever started this program has ignored stays ignored, as nohup(1) asks for SIGHUP and a shell for SIGINT
and SIGQUIT of what it puts into the background.  Nothing that takes long is loaded here: the first lines of the program
call it.
"""

import os
import signal
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop
    from types import FrameType

STOPS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGXCPU)  # the last: SIGKILL is next
_HARMLESS = {signal.SIGCHLD, signal.SIGURG, signal.SIGWINCH, signal.SIGCONT, signal.SIGPIPE, signal.SIGXFSZ}
_JOB_CONTROL = {signal.SIGSTOP, signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU, signal.SIGKILL}
_ERRORS = {signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGABRT, signal.SIGTRAP, signal.SIGSYS}
STRAYS = tuple(sorted(signal.valid_signals() - {*STOPS} - _HARMLESS - _JOB_CONTROL - _ERRORS))  # by default they kill


def guard_the_start() -> None:
    """Let a stop end the start at once, and nothing else do so.

    For the first instant of a program: as the first process of a container it gets no signal that it has no handler
    for, and a stop that is lost is followed by a start.  SIGINT has Python's own handler.
    """
    for number in (*STOPS, *STRAYS):
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _end_at_once if number in STOPS else _not_now)


def take_signals(loop: "AbstractEventLoop", stop: Callable[[str], None], told: Callable[[str], None]) -> list[str]:
    """From here on the loop calls `stop` and `told` with the name of a signal.

    Returns: the stops that are ignored, since whoever started this program did so.
    """
    ignored = [number for number in STOPS if signal.getsignal(number) is signal.SIG_IGN]
    for number in STOPS:
        if number not in ignored:
            loop.add_signal_handler(number, stop, _name(number))
    for number in STRAYS:
        if signal.getsignal(number) in (signal.SIG_DFL, _not_now):
            loop.add_signal_handler(number, told, _name(number))
    return [_name(number) for number in ignored]


def _name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # one of the real-time signals between the named ones
        return f"SIGRTMIN+{number - signal.SIGRTMIN}"


def _end_at_once(number: int, _frame: "FrameType | None") -> None:
    """Die of the signal, so that a supervisor sees what it expects; the first process of a container cannot."""
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
    os._exit(128 + number)


def _not_now(_number: int, _frame: "FrameType | None") -> None:
    """Nothing: without a handler it would kill."""

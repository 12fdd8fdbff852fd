"""The event loop of a command: one that the system denies is denied before anything of it is made."""

import asyncio
import contextlib
import select
import socket
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, TypeVar

Result = TypeVar("Result")


@contextlib.contextmanager
def loop_runner() -> Iterator[asyncio.Runner]:
    """A runner whose loop is made.  OSError: the system denies the files that a loop needs."""
    with (
        select.epoll(),
        contextlib.ExitStack() as pair,
    ):  # asyncio leaves half a loop behind, which complains at its end
        for one in socket.socketpair():
            pair.enter_context(one)
    with asyncio.Runner() as runner:
        runner.get_loop()
        yield runner


def run_loop(main: Callable[..., Coroutine[Any, Any, Result]], *arguments: Any) -> Result:
    """Run a coroutine function to its end.  OSError: as above, and none of it has run."""
    with loop_runner() as runner:
        return runner.run(main(*arguments))

"""The command line for tests: `acu-daemon ...` inside this process, with its exit status and what it printed."""

import contextlib
import io
import sys
from dataclasses import dataclass

import pytest

from acu_daemon.cli import main


@dataclass(frozen=True)
class Done:
    code: int
    out: str
    err: str


def acu_daemon(*arguments: object) -> Done:
    """Run a command to its end."""
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        patch.setattr(sys, "argv", ["acu-daemon", *map(str, arguments)])
        patch.setattr(sys.modules["__main__"], "__package__", "")  # whatever pytest was started by: help names it
        try:
            main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0
    return Done(code, out.getvalue(), err.getvalue())

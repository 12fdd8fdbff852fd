"""The end of a long computation by Ctrl-C: at once, with one line.  Its processes are those of a campaign."""

import sys
from collections.abc import Callable
from typing import NoReturn

from tables.console import say

INTERRUPTED = 130


def run_script(main: Callable[[], int]) -> NoReturn:
    """End the process with what main returns, or, where Ctrl-C ended it, with one line and status 130."""
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        say("\ninterrupted" if sys.stderr.isatty() else "interrupted")  # the bar's line is left first
        sys.exit(INTERRUPTED)

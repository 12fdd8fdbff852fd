"""What a long computation says on standard error."""

import sys

_WIDTH = 40


def say(text: str) -> None:
    """One line."""
    print(text, file=sys.stderr, flush=True)


def progress(done: int, total: int) -> None:
    """A bar, redrawn on a terminal; a line every tenth elsewhere."""
    filled = _WIDTH * done // total
    bar = f"[{'#' * filled}{'.' * (_WIDTH - filled)}] {done}/{total}"
    if sys.stderr.isatty():
        print(f"\r{bar}", end="\n" if done == total else "", file=sys.stderr, flush=True)
    elif done == total or done * 10 // total != (done - 1) * 10 // total:
        say(bar)

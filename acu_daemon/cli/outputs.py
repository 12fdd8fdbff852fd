"""Files that commands write: what cannot be written is said before the work, not after it."""

import os
from pathlib import Path

from acu_daemon.errors import UsageError

_PICTURES = (".png", ".svg", ".pdf")


def refuse_unwritable(*paths: Path | None) -> None:
    """UsageError: a file cannot be made at one of the paths; says why."""
    for path in paths:
        if path is not None and (reason := _why_not(path)):
            raise UsageError(f"{path}{reason}")


def refuse_no_picture(path: Path | None) -> None:
    """UsageError: no picture can be drawn into this file."""
    if path is not None and path.suffix.lower() not in _PICTURES:
        raise UsageError(f"--plot {path}: expected a name that ends in {', '.join(_PICTURES)}")
    refuse_unwritable(path)


def _why_not(path: Path) -> str | None:
    folder = path.absolute().parent
    try:
        if path.is_dir():
            return " is a directory; give a file's name"
        if not folder.is_dir():
            return f": there is no directory {path.parent}; make it first"
        is_ours = os.access(path if path.exists() else folder, os.W_OK)
    except OSError as error:
        return f": {error.strerror}"
    return None if is_ours else " cannot be written: permission denied"


def write_ascii(path: Path, text: str) -> None:
    """UsageError: the file cannot be written, such as on a full disk.  Other characters become question marks."""
    try:
        path.write_text(text, encoding="ascii", errors="replace")
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None

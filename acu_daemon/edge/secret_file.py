"""A file with a secret that nobody else may read: the page's token, a broker's password."""

import os
import stat
from pathlib import Path

from acu_daemon.errors import UsageError

MOST_BYTES = 1024


def read_secret(path: Path, key: str, make: str = "") -> bytes:
    """The secret, without the space around it.  key: of station.toml, that names the file; make: how one is made.

    The file that is looked at is the one that is read, and none, such as a pipe, keeps its reader waiting.
    UsageError: says what to do.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError as error:
        raise UsageError(f"{key} {path}: {error.strerror}{make and '; make one: '}{make}") from None
    except PermissionError as error:
        raise UsageError(f"{key} {path}: {error.strerror}; it must belong to the daemon's user: chown") from None
    except OSError as error:
        raise UsageError(f"{key} {path}: {error.strerror}") from None
    try:
        found = os.fstat(descriptor)
        mode = stat.S_IMODE(found.st_mode)
        if not stat.S_ISREG(found.st_mode) or mode & 0o077:
            raise UsageError(
                f"{key} {path}: mode {mode:04o}, expected a file of 0600 that nobody else reads; chmod 600 {path}"
            )
        secret = os.read(descriptor, MOST_BYTES + 1)
    finally:
        os.close(descriptor)
    if len(secret) > MOST_BYTES:
        raise UsageError(f"{key} {path}: expected at most {MOST_BYTES} bytes")
    return secret.strip()

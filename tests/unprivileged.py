"""Commands without the rights of root: root may do what an operator's daemon may not, and proves nothing."""

import functools
import os
import shutil
import subprocess
import sys

import pytest

NOBODY = 65534
_NO_ROOT = ("setpriv", "--bounding-set", "-dac_override,-dac_read_search,-sys_admin,-sys_resource,-net_bind_service")
_AS_NOBODY = ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups")
_STILL_READS = ("--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search")  # this Python, wherever it lies


def without_rights() -> tuple[str, ...]:
    """What to put before a command so that the modes of files hold for it, also where the tests run as root."""
    return () if os.geteuid() else _tried(_NO_ROOT)


def as_nobody() -> tuple[str, ...]:
    """The same with a user of its own, who is bound by the limits of users too."""
    return () if os.geteuid() else _tried(_AS_NOBODY + _STILL_READS)


@functools.cache
def _is_possible(prefix: tuple[str, ...]) -> bool:
    if shutil.which(prefix[0]) is None:
        return False
    done = subprocess.run([*prefix, sys.executable, "-c", "import acu_daemon"], capture_output=True, check=False)
    return done.returncode == 0


def _tried(prefix: tuple[str, ...]) -> tuple[str, ...]:
    if not _is_possible(prefix):
        pytest.skip("rights cannot be given up here (setpriv)")
    return prefix

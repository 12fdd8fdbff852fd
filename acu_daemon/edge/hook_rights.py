"""What a hook may do: what its user may, and nothing that this process was given beyond its own.

    nice  ->  setpriv (util-linux): no new privileges, no capabilities, another user  ->  the hook

They shed the rights in the hook's own process, one after the other: the loop waits for no fork of the whole daemon, and
nothing is left to a program that is no longer its user's.  Real-time priority ends with the fork (edge.scheduling).
"""

import grp
import os
import pwd
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from shutil import which

from acu_daemon.errors import UsageError

NICENESS = 10
UMASK = 0o027
KEPT = ("PATH", "LANG", "LANGUAGE", "TZ", "TMPDIR", "HOME", "USER", "LOGNAME", "SHELL")  # and LC_...: all that is told
STATUS = Path("/proc/self/status")
CAP_KILL, CAP_SETGID, CAP_SETUID = 5, 6, 7  # capabilities(7): to switch, and to end a hook that hangs
NEEDED = ("CAP_SETUID", "CAP_SETGID", "CAP_KILL")


@dataclass(frozen=True, slots=True)
class HookUser:
    """Whose hooks are, with all the groups of that user."""

    name: str
    uid: int
    gid: int
    groups: tuple[int, ...]
    home: str
    shell: str

    @property
    def is_us(self) -> bool:
        return (self.uid, self.gid) == (os.geteuid(), os.getegid())


@cache
def hook_user(name: str) -> HookUser:
    """The user of [hooks] user.  UsageError: there is none."""
    try:
        found = pwd.getpwnam(name)
    except KeyError:
        raise UsageError(f"[hooks] user = {name!r}: this machine has no such user") from None
    groups = tuple(sorted(os.getgrouplist(name, found.pw_gid)))
    return HookUser(name, found.pw_uid, found.pw_gid, groups, found.pw_dir, found.pw_shell)


def why_not_switch(user: HookUser) -> str:
    """Why this process may not start hooks as a user; empty: it may."""
    bits = _status("CapEff")
    if user.is_us or all(bits >> one & 1 for one in (CAP_SETUID, CAP_SETGID, CAP_KILL)):
        return ""
    return (
        f"[hooks] user = {user.name!r}: this process, of user {os.geteuid()}, may not start programs as another one: "
        f"run it as root, or with {', '.join(NEEDED)}"
    )


def chosen_user(name: str | None) -> HookUser | None:
    """As whom hooks run; None: as this process.  UsageError: there is no such user, or this process may not switch."""
    if name is None:
        return None
    user = hook_user(name)
    if why := why_not_switch(user):
        raise UsageError(why)
    return user


def launch(command: Sequence[str], user: HookUser | None) -> list[str]:
    """The command line that sheds the rights and becomes the hook.  user None: that of this process."""
    more = max(
        NICENESS, NICENESS - os.getpriority(os.PRIO_PROCESS, 0)
    )  # a service's own negative niceness is not theirs
    return ["nice", "-n", str(more), *_shed(user), *command]


def _shed(user: HookUser | None) -> list[str]:
    """Nothing where there is nothing to shed: a service's sandbox, which has seen to it, may deny even that."""
    switch = [] if user is None or user.is_us else _switch(user)
    if not switch and _status("NoNewPrivs") and not _status("CapAmb") and not _status("CapInh"):
        return []
    return ["setpriv", "--no-new-privs", "--inh-caps=-all", "--ambient-caps=-all", *switch, "--"]


def _switch(user: HookUser) -> list[str]:
    groups = ",".join(str(gid) for gid in user.groups)
    return [f"--reuid={user.uid}", f"--regid={user.gid}", f"--groups={groups}"]


def environment(user: HookUser | None) -> dict[str, str]:
    """What of this process' environment a hook is told: a list, so that no secret of the daemon's is among it."""
    kept = {name: value for name, value in os.environ.items() if name in KEPT or name.startswith("LC_")}
    if user is None or user.is_us:
        return kept
    return kept | {"HOME": user.home, "USER": user.name, "LOGNAME": user.name, "SHELL": user.shell}


def directory(user: HookUser | None) -> str | None:
    """Where a hook begins; None: where this process is.  Another user may not even look there."""
    return None if user is None or user.is_us else "/"


def said_of_rights(user: HookUser | None) -> str:
    """Whose the hooks are, for people."""
    if user is None:
        return f"run as this user, {_name(os.geteuid())}"
    return f"run as {user.name}, groups {', '.join(_group(gid) for gid in user.groups)}"


def is_there_a_launcher() -> bool:
    """Whether the programs that shed rights are on this machine."""
    return all(which(name) for name in ("nice", "setpriv"))


def _name(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return str(uid)


def _group(gid: int) -> str:
    try:
        return grp.getgrgid(gid).gr_name
    except KeyError:
        return str(gid)


def _status(key: str) -> int:
    """A number of this process' /proc status, capabilities as bits; 0: the kernel does not tell."""
    try:
        lines = STATUS.read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1], 16) for line in lines if line.startswith(f"{key}:")), 0)

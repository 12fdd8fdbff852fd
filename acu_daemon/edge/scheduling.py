"""How the kernel schedules this process: reported, and kept to the loop's own thread (sched(7))."""

import contextlib
import os

_POLICIES = {
    os.SCHED_OTHER: "SCHED_OTHER",
    os.SCHED_BATCH: "SCHED_BATCH",
    os.SCHED_IDLE: "SCHED_IDLE",
    os.SCHED_FIFO: "SCHED_FIFO",
    os.SCHED_RR: "SCHED_RR",
}
_REAL_TIME = (os.SCHED_FIFO, os.SCHED_RR)
TRIED_PRIORITY = 30


def scheduling_text(pid: int = 0) -> str:
    """The policy in force for a process or thread (0: this one), with its priority, such as "SCHED_FIFO 30"."""
    policy = os.sched_getscheduler(pid) & ~os.SCHED_RESET_ON_FORK
    name = _POLICIES.get(policy, str(policy))
    return f"{name} {os.sched_getparam(pid).sched_priority}" if policy in _REAL_TIME else name


def keep_to_this_thread() -> str:
    """Leave threads and processes that are made from here on at normal priority; returns the policy in force here."""
    policy = os.sched_getscheduler(0)
    if policy in _REAL_TIME:  # without the flag, as under chrt
        with contextlib.suppress(OSError):  # a hardened service may not; its unit file has set the flag
            os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, os.sched_getparam(0))
    return scheduling_text()


def may_be_real_time() -> bool:
    """Whether this process is scheduled by SCHED_FIFO or could be: it is tried for an instant."""
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    if before & ~os.SCHED_RESET_ON_FORK in _REAL_TIME:
        return True
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(TRIED_PRIORITY))
    except OSError:
        return False
    os.sched_setscheduler(0, before, parameters)
    return True

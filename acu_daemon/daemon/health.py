"""What the supervisor hears of the daemon: ready once, alive only while the ACU is served, and one line of status."""

from collections.abc import Callable

from acu_daemon.daemon import words
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms, verdict

FEED_S = 0.5  # between two signs of life; systemd's limit is WatchdogSec
STATUS_S = 1.0


class Health:
    """Watches snapshot after snapshot.

    A sign of life is sent only when an ordered exchange was answered since the last one (a register write where one was
    due, a poll elsewhere), or, with the link down, when the reconnect made another attempt: a loop that turns and does
    neither starves the watchdog.
    """

    def __init__(self, notify: Callable[[str], None]) -> None:
        self._notify = notify
        self._is_ready = False
        self._fed: tuple[int, int] = (0, 0)
        self._fed_tai_s = self._told_tai_s = -1e18

    def see(self, seen: Snapshot) -> None:
        """Take the newest snapshot."""
        if not self._is_ready and seen.az_deg is not None:
            self._is_ready = True
            self._notify("READY=1")
        done = (seen.answered_count, seen.attempt_count)
        if done != self._fed and seen.tai_s - self._fed_tai_s >= FEED_S:
            self._fed, self._fed_tai_s = done, seen.tai_s
            self._notify("WATCHDOG=1")
        if seen.tai_s - self._told_tai_s >= STATUS_S:
            self._told_tai_s = seen.tai_s
            self._notify(f"STATUS={status_line(seen)}")


def status_line(seen: Snapshot) -> str:
    """The line that `systemctl status` shows: verdict and alarms first, but for what marks a simulation."""
    marks = [mark for mark, is_on in (("REHEARSAL", seen.is_rehearsal), ("SIMULATION", seen.is_simulation)) if is_on]
    parts = [*marks, verdict(seen).word, *alarms(seen), words.coming(seen), words.pointing(seen), seen.state]
    if seen.is_link_up and seen.az_deg is not None and seen.el_deg is not None:
        parts.append(f"az {seen.az_deg:.2f} el {seen.el_deg:.2f} deg")
    if seen.fit_age_s is not None:
        parts.append(f"fit {seen.fit_age_s:.0f} s old")
    return ", ".join(part for part in parts if part)

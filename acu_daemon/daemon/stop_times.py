"""When the newest STOP went out, and when the ACU confirmed it.  Pure."""

from dataclasses import dataclass, replace

from acu_daemon.acu.replies import Done, Reply


@dataclass(frozen=True, slots=True)
class StopTimes:
    """TAI s; None: there was none.  A STOP that is sent again until it is confirmed keeps the time of the first."""

    sent_tai_s: float | None = None
    confirmed_tai_s: float | None = None

    def after(self, started_tai_s: float, first_byte_tai_s: float | None, reply: Reply | None) -> "StopTimes":
        """After one more STOP and what came back."""
        is_anew = self.sent_tai_s is None or self.confirmed_tai_s is not None
        times = StopTimes(started_tai_s) if is_anew else self
        return replace(times, confirmed_tai_s=first_byte_tai_s) if isinstance(reply, Done) else times

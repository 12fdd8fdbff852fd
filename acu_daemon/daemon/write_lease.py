"""The write lease of a running daemon: the one object that all who command by hand ask, and what the log says of it."""

from collections.abc import Callable
from typing import Any

import structlog

from acu_daemon.control import lease as rules
from acu_daemon.control.lease import Claim, Lease


class WriteLease:
    """Owned by the loop; lives as long as the process, through all its runs.  now_s: a monotonic clock."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._lease: Lease | None = None
        self._log: Any = structlog.get_logger("lease")

    @property
    def held(self) -> Lease | None:
        """Who has it now."""
        found = rules.holder(self._lease, self._now_s())
        if found is None and self._lease is not None:
            self._log.info("lease.over", name=self._lease.claim.name, via=self._lease.claim.via)
            self._lease = None
        return found

    def take(self, claim: Claim, *, takes_over: bool = False) -> str:
        """Take it, or have it longer where it is one's own; returns why not, empty: it is taken."""
        before = self.held
        refused = rules.why_not(before, claim, self._now_s(), takes_over=takes_over)
        if refused:
            self._log.info("lease.refused", name=claim.name, via=claim.via, reason=refused)
            return refused
        self._lease = rules.taken(before, claim, self._now_s())
        fields = {"name": claim.name, "via": claim.via, "reason": claim.reason, "lasts_s": claim.lasts_s}
        if before is None:
            self._log.info("lease.taken", **fields)
        elif before.claim.key != claim.key:
            whose = f"{before.claim.name} by {before.claim.via}"
            self._log.warning("lease.taken_over", **fields, before=whose)
        return ""

    def use(self, key: str) -> bool:
        """Whether this one has it; using it makes it last."""
        if self.held is None or not rules.is_held_by(self._lease, key, self._now_s()):
            return False
        self._lease = rules.used(self._lease, key, self._now_s())
        return True

    def give_back(self, key: str) -> None:
        """Leave it to others; who has it not gives nothing back."""
        before = self.held
        self._lease = rules.given_back(before, key, self._now_s())
        if before is not None and self._lease is None:
            self._log.info("lease.given_back", name=before.claim.name, via=before.claim.via)

    def left_s(self) -> float:
        """Until it ends unless it is used; 0: it is free."""
        held = self.held
        return 0.0 if held is None else max(0.0, held.end_s - self._now_s())

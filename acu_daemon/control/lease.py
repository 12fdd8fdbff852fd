"""The write lease: which one person or program may command the antenna by hand now.  Pure.

             take                     use: ends later
    free ------------> held by one <---------.
     ^                  |  |  |  `-----------'
     |   its time over, |  |  `-- take, by another who says that it takes over --> held by the other
     `--- given back ---'  `----- take, by another who does not ---> refused: who has it, why, for how long

It ends by itself, so nobody who has gone keeps others out.  STOP never asks for it.
Times are seconds of one monotonic clock, given by whoever calls.
"""

from dataclasses import dataclass, replace

LASTS_S = 120.0  # after the last use
LONGEST_TEXT = 60  # characters of a name or a reason


@dataclass(frozen=True, slots=True)
class Claim:
    """Who wants the lease.  key tells holders apart: a connection or a peer's address, never shown."""

    key: str
    name: str
    via: str  # "page", "rotctl"
    reason: str = ""
    lasts_s: float = LASTS_S

    def __post_init__(self) -> None:
        for field in ("name", "reason"):  # from outside: one line of letters that can be printed, and not long
            text = "".join(letter if letter.isprintable() else " " for letter in getattr(self, field))
            object.__setattr__(self, field, " ".join(text.split())[:LONGEST_TEXT])


@dataclass(frozen=True, slots=True)
class Lease:
    """Who has it, since when, and until when unless it is used."""

    claim: Claim
    since_s: float
    end_s: float

    def words(self, now_s: float) -> str:
        """Who has it, for people."""
        why = f", {self.claim.reason}" if self.claim.reason else ""
        return f"{self.claim.name} by {self.claim.via}{why}, for {max(0.0, self.end_s - now_s):.0f} s more"


def holder(lease: Lease | None, now_s: float) -> Lease | None:
    """The lease that is in force; None: it is free."""
    return lease if lease is not None and now_s < lease.end_s else None


def is_held_by(lease: Lease | None, key: str, now_s: float) -> bool:
    """Whether this one may command by hand."""
    held = holder(lease, now_s)
    return held is not None and held.claim.key == key


def why_not(lease: Lease | None, claim: Claim, now_s: float, *, takes_over: bool = False) -> str:
    """Why the claim is refused; empty: it may have the lease."""
    held = holder(lease, now_s)
    if held is None or takes_over or held.claim.key == claim.key:
        return ""
    return f"the lease is held by {held.words(now_s)}"


def taken(lease: Lease | None, claim: Claim, now_s: float) -> Lease:
    """The claim's lease.  Who has it already keeps its beginning, and may change name, reason and length."""
    since_s = lease.since_s if lease is not None and is_held_by(lease, claim.key, now_s) else now_s
    return Lease(claim, since_s, now_s + claim.lasts_s)


def used(lease: Lease | None, key: str, now_s: float) -> Lease | None:
    """The lease after its holder has used it; anybody else changes nothing."""
    held = holder(lease, now_s)
    if held is None or held.claim.key != key:
        return held
    return replace(held, end_s=now_s + held.claim.lasts_s)


def given_back(lease: Lease | None, key: str, now_s: float) -> Lease | None:
    """None, where it was this one's."""
    held = holder(lease, now_s)
    return None if held is not None and held.claim.key == key else held

"""When a server of elements is asked, and when no more.  Pure: what came of it and the time go in, the next state out.

A group is asked at most once in so many hours.  Good answers, a 304 among them, set the pace.  Any other 3xx or a 4xx
says that we are not wanted, or not so: nobody asks again until a person says so, since a machine that goes on is barred
by its address.  Time-outs, broken lines and 5xx are tried again, ever later.  An answer of 200 that cannot be used
counts as asked, and is waited for ever longer too.  The state is written before a server is asked, as if it had failed:
a process that dies in the middle cannot ask in a storm.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf

HOUR_S = 3600.0
FIRST_PAUSE_S = 900.0  # after a first failure, then twice as long each time
LONGEST_PAUSE_S = 24 * HOUR_S


class Came(StrEnum):
    """What came of asking."""

    GOOD = "good"
    UNCHANGED = "unchanged"  # 304
    REFUSED = "refused"  # any other 3xx, 4xx: a person has to look
    FAILED = "failed"  # no answer, a broken one, 5xx
    UNUSABLE = "unusable"  # 200, but not what was asked for


@dataclass(frozen=True, slots=True)
class FetchOutcome:
    """What came of asking, and what a server said beside it.  reason: why it was not good, in words."""

    came: Came
    reason: str = ""
    last_modified: str = ""
    etag: str = ""
    retry_after_s: float = 0.0


@dataclass(frozen=True, slots=True)
class FetchState:
    """How things stand with one URL.  Times are TAI; -inf: never."""

    url: str
    asked_tai_s: float = -inf
    next_tai_s: float = -inf
    good_tai_s: float = -inf  # the last answer that was good, 304 included
    last_modified: str = ""
    etag: str = ""
    failed_count: int = 0  # in a row
    problem: str = ""  # why the newest answer was not good
    stopped: str = ""  # why nobody asks until a person says so
    not_taken: str = ""  # which sets of the newest good answer are not used, and why: told when it changes


def is_due(state: FetchState, now_tai_s: float, every_s: float) -> bool:
    """Whether the server may be asked now.

    A next time that is further off than any pause was written by a clock that was wrong: it does not hold for ever.
    """
    if state.stopped:
        return False
    longest_s = max(every_s, LONGEST_PAUSE_S)
    return now_tai_s >= state.next_tai_s or state.next_tai_s - now_tai_s > 2.0 * longest_s


def before_asking(state: FetchState, now_tai_s: float, every_s: float) -> FetchState:
    """What is written before a server is asked: as if there had been no answer."""
    return after(
        state, FetchOutcome(Came.FAILED, "the process that asked has ended before the answer"), now_tai_s, every_s
    )


def after(state: FetchState, outcome: FetchOutcome, now_tai_s: float, every_s: float) -> FetchState:
    """The state after an answer.  state: that from before the server was asked."""
    asked = replace(state, asked_tai_s=now_tai_s)
    match outcome.came:
        case Came.GOOD | Came.UNCHANGED:
            is_new = outcome.came is Came.GOOD
            return replace(
                asked,
                next_tai_s=now_tai_s + every_s,
                good_tai_s=now_tai_s,
                last_modified=outcome.last_modified if is_new else state.last_modified,
                etag=outcome.etag if is_new else state.etag,
                failed_count=0,
                problem="",
            )
        case Came.REFUSED:
            return replace(asked, next_tai_s=now_tai_s + every_s, problem=outcome.reason, stopped=outcome.reason)
    first_s = every_s if outcome.came is Came.UNUSABLE else FIRST_PAUSE_S
    pause_s = min(first_s * 2.0 ** min(state.failed_count, 20), max(first_s, LONGEST_PAUSE_S))
    pause_s = max(pause_s, min(outcome.retry_after_s, LONGEST_PAUSE_S))
    return replace(asked, next_tai_s=now_tai_s + pause_s, failed_count=state.failed_count + 1, problem=outcome.reason)


def resumed(state: FetchState, now_tai_s: float, every_s: float) -> FetchState:
    """A person has looked: ask again, but no earlier than the pace allows."""
    next_tai_s = max(now_tai_s, min(state.asked_tai_s, now_tai_s) + every_s) if state.good_tai_s > -inf else now_tai_s
    return replace(state, next_tai_s=next_tai_s, failed_count=0, problem="", stopped="")


def is_news(before: FetchState, later: FetchState, outcome: FetchOutcome) -> bool:
    """Whether people are told: of an answer that is good and new, and of a problem once, not each time it comes."""
    if outcome.came is Came.GOOD:
        return True
    return bool(before.problem) if outcome.came is Came.UNCHANGED else before.problem != later.problem

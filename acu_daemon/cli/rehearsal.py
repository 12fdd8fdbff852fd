"""The clock of a rehearsal, shared by `run` and `fake-acu` on one machine, and what is said of it."""

from acu_daemon.cli.options import make_clock, parse_utc
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.rehearsal_clock import TOGETHER_S, Meeting, Role, SharedClock, look_for_simulator, meet
from acu_daemon.orbit.timescales import utc_text

ANEW = "to begin anew, end both and start both again"
_SIDES = {Role.DAEMON: "the simulator", Role.ACU: "the daemon"}


def meet_in_rehearsal(
    url: str, role: Role, at: str | None, at_monotonic_s: float | None
) -> tuple[SystemClock, Meeting]:
    """The clock in force, that of the other side where it rehearses the same; ours stands there until it is closed.

    url: of the ACU.  With --at-monotonic, and without --at, a process keeps its own; a daemon without --at, which is
    no rehearsal, leaves and looks for none.
    """
    clock = make_clock(at, at_monotonic_s)
    own = SharedClock(None if at is None else parse_utc("--at", at), clock.tai_s() - clock.monotonic_s())
    if at is None and role is Role.DAEMON:
        return clock, Meeting(own)
    met = meet(url, role, own, may_take=at_monotonic_s is None)
    return (SystemClock(met.clock.offset_s, 0.0) if met.is_taken else clock), met


def met_by_chance(url: str, clock: SystemClock) -> Meeting:
    """What a run that is no rehearsal finds: a simulator at the ACU's address, maybe at another time."""
    return Meeting(SharedClock(None, clock.tai_s() - clock.monotonic_s()), look_for_simulator(url))


def clock_text(met: Meeting, role: Role, monotonic_s: float) -> tuple[str, bool]:
    """What there is to say of both clocks now, and whether it is a warning."""
    side, other = _SIDES[role], met.other
    if met.problem:
        return f"its own, and none can be shared with {side}: {met.problem}; give both the same --at-monotonic", True
    if other is None:
        return _alone_text(role), False
    if met.is_taken:
        since_s = monotonic_s - met.clock.begun_s
        return f"that of {side} (process {other.pid}), now {since_s:.1f} s after --at; {ANEW}", False
    if abs(met.apart_s) <= TOGETHER_S:
        return f"its own; that of {side} (process {other.pid}) agrees", False
    at = "without --at" if other.at_tai_s is None else f"with --at {utc_text(other.at_tai_s, 3)}"
    return (
        f"its own; that of {side} (process {other.pid}, started {at}) is {abs(met.apart_s):.1f} s "
        f"{'ahead' if met.apart_s > 0 else 'behind'}, so the satellite is elsewhere; start both with the same --at, "
        "without --at-monotonic"
    ), True


def _alone_text(role: Role) -> str:
    if role is Role.ACU:
        return "its own: a daemon that is started with the same --at on this machine takes it"
    return (
        "its own: no simulator of this user has left one at this address; `fake-acu` started with the same --at takes "
        "this one; a simulator of another hand, or on another machine, has to be at the same UTC by itself"
    )

"""One short flight for every fault, and what is measured of it; scripts/fault_table.py prints it."""

import math
from collections import defaultdict
from dataclasses import dataclass
from functools import lru_cache

from flights import LSB_DEG, RISING_TAI_S, Script, climb, demo_target

from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.drivers.sa3842.messages import WriteAndPoll, WriteRegisters
from acu_daemon.edge.clock import LoopClock
from acu_daemon.units import wrap_180

T = RISING_TAI_S
LOST_S, FAULT_S, BACK_S = 11.0, 14.0, 23.0  # the signal goes, the fault begins, the signal comes back
ON_PATH_DEG = 0.1
BURST_S = 0.030  # two register writes nearer than this are a burst; a late tick may halve the period, no more
ROUNDING_S = 1e-6  # of differences of TAI
STALE_S = 0.1  # a register write that was applied so long after it was sent


@dataclass(frozen=True)
class Case:
    """A fault in a flight.  over_s: when its cause has gone; shows: states that must show meanwhile, in their order."""

    faults: tuple[str, ...]
    over_s: float
    shows: tuple[str, ...] = ()
    losses: tuple[tuple[float, float], ...] = ((LOST_S, BACK_S),)
    says: str = ""  # an event that the log must hold
    from_s: float = FAULT_S
    recovers_s: float = 2.5  # to be on the path again, at the latest: a second of back-off is in it
    clear_s: float | None = None  # a person clears the latch then, the fault mended
    arm_s: float | None = None  # a person arms then
    back_s: float = BACK_S


@dataclass(frozen=True)
class Measured:
    """What a flight showed."""

    states: tuple[str, ...]
    events: frozenset[str]
    worst_deg: float  # from the begin of the fault until the antenna is on the path again
    recovered_s: float  # from the end of the cause until the antenna is on the path for good
    after_deg: float  # worst from then on, until the signal is back and a second beyond
    end_state: str
    outside_count: int  # commands outside the limits, or faster than the axis while followed
    burst_count: int
    stale_count: int


WIRE_S = FAULT_S + 3.0
ARM_S = WIRE_S + 1.0


def wire(verb: str, keys: str = "", shows: tuple[str, ...] = (), *, says: str = "", recovers_s: float = 0.5) -> Case:
    """A fault for three seconds of the loss; one that costs the link or the mode may take longer."""
    recovers_s = 2.5 if shows else recovers_s
    return Case((f"{verb} start_s={FAULT_S} duration_s=3 {keys}",), WIRE_S, shows, says=says, recovers_s=recovers_s)


def latch(verb: str, until_s: float, keys: str = "") -> Case:
    """An axis that does not obey until it is mended, and then a person clears the latch."""
    back_s = until_s + 5.0
    faults = (f"{verb} start_s={FAULT_S - 2} duration_s={until_s - FAULT_S + 2} {keys}",)
    return Case(
        faults,
        until_s + 0.5,
        ("FAULT", "HOLD/FITTED"),
        ((LOST_S, back_s),),
        "axis.latched",
        FAULT_S - 2,
        recovers_s=6.0,  # from where it stopped, as fast as the drive goes
        clear_s=until_s + 0.5,
        back_s=back_s,
    )


LINK_LOST = ("LINK-LOST", "HOLD/FITTED")
CASES: dict[str, Case] = {
    "no-reply": wire("no-reply", "count=3"),
    "no-reply for 3 s": wire("no-reply", "", LINK_LOST),
    "no-reply 3 in 10": wire("no-reply", "probability=0.3 seed=1"),
    "lost command 3 in 10": wire("no-reply", "probability=0.3 on=command seed=1"),
    "late-reply": wire("late-reply", "", LINK_LOST),
    "late-reply 3 in 10": wire("late-reply", "probability=0.3 seed=1"),
    "shifted": wire("shifted", "", LINK_LOST),
    "glued": wire("glued"),
    "split": wire("split"),
    "duplicate": wire("duplicate"),
    "bad-checksum": wire("bad-checksum", "probability=0.3 seed=1"),
    "xor-blind": wire("xor-blind", "probability=0.3 seed=1", says="acu.doubted"),
    "xor-blind command": wire("xor-blind", "probability=0.1 on=command seed=1"),
    "swapped-digits": wire("swapped-digits", "probability=0.3 seed=1", says="acu.doubted"),
    "swapped-digits command": wire("swapped-digits", "probability=0.1 on=command seed=1"),
    "truncated": wire("truncated", "probability=0.3 seed=1"),
    "garbage-before": wire("garbage-before", "seed=1"),
    "garbage-after": wire("garbage-after", "seed=1"),
    "wrong-address": wire("wrong-address", "", LINK_LOST),
    "not-hex": wire("not-hex", "", LINK_LOST),
    "out-of-range": wire("out-of-range", "", says="acu.doubted"),
    "nak": wire("nak", "", says="acu.nak", recovers_s=2.0),
    "latency": wire("latency", "value=0.04"),
    "jitter": wire("jitter", "value=0.07 seed=1"),
    "bandwidth": wire("bandwidth"),
    "wrong-baud": wire("wrong-baud", "seed=1", LINK_LOST),
    "break": wire("break", "count=8", LINK_LOST),
    "cut": wire("cut", "", LINK_LOST),
    "deaf": wire("deaf", "", LINK_LOST),
    "half-open": Case((f"half-open start_s={FAULT_S}",), FAULT_S, LINK_LOST),
    "reset": Case((f"reset start_s={FAULT_S}",), FAULT_S, says="link.lost"),
    "slow-close": Case(
        (f"slow-close start_s={FAULT_S - 1} duration_s=3 value=2", f"reset start_s={FAULT_S}"), FAULT_S + 2.0, LINK_LOST
    ),
    "accept-then-close": Case(
        (f"accept-then-close start_s={FAULT_S - 1} duration_s=4", f"reset start_s={FAULT_S}"), WIRE_S, LINK_LOST
    ),
    "refuse": Case((f"refuse start_s={FAULT_S - 1} duration_s=4", f"reset start_s={FAULT_S}"), WIRE_S, LINK_LOST),
    "second-client": wire("second-client", "", LINK_LOST),
    "unplug": wire("unplug", "", LINK_LOST),
    "frozen-encoder": wire("frozen-encoder", "axis=both"),
    "frozen-encoder tracking": Case(
        ("frozen-encoder start_s=8 duration_s=4 axis=both",), 12.0, losses=((13.0, BACK_S),), from_s=8.0
    ),
    "encoder-jump": wire("encoder-jump", "", says="acu.doubted", recovers_s=2.0),
    "encoder-jump tracking": Case(("encoder-jump start_s=8 duration_s=4",), 12.0, losses=((14.0, BACK_S),), from_s=8.0),
    "encoder-turn": wire("encoder-turn"),
    "power-cycle": Case((f"power-cycle start_s={FAULT_S} duration_s=2",), FAULT_S + 2.0, LINK_LOST),
    "power-cycle tracking": Case(
        ("power-cycle start_s=8 duration_s=1",), 9.0, ("LINK-LOST",), ((14.0, BACK_S),), from_s=8.0, recovers_s=3.0
    ),
    "local-panel": wire("local-panel", "", ("MANUAL", "HOLD/FITTED")),
    "emergency-stop": Case(
        (f"emergency-stop start_s={FAULT_S} duration_s=3",),
        ARM_S,
        ("FAULT", "HOLD/FITTED"),
        says="disarmed",
        arm_s=ARM_S,
    ),
    "limit-switch": wire("limit-switch", "axis=elevation"),
    "stuck": wire("stuck", "axis=elevation"),
    "stuck for good": latch("stuck", 23.0, "axis=elevation"),
    "runaway for good": latch("runaway", 18.0),
    "reversed for good": latch("reversed", 18.0, "axis=elevation"),
    "slow-drive": wire("slow-drive", "axis=elevation value=0.02"),
    "runaway": Case((f"runaway start_s={FAULT_S} duration_s=0.3",), FAULT_S + 0.3),
    "reversed": Case((f"reversed start_s={FAULT_S} duration_s=0.5 axis=elevation",), FAULT_S + 0.5),
    "backlash": wire("backlash", "axis=both value=0.1"),
    "wind": wire("wind", "axis=both"),
    "false-lock": Case(("false-lock start_s=10 duration_s=2",), 12.0, losses=((14.0, BACK_S),), from_s=10.0),
    "clock-step": Case((), FAULT_S, says="clock.stepped"),
}


class SteppedClock(LoopClock):
    """The system clock jumps by an hour when the other faults begin."""

    def follow(self) -> float:
        return 3600.0 if self.tai_s() > T + FAULT_S else 0.0


@lru_cache(maxsize=1)
def flown(name: str) -> Flight:
    """The flight of a case; that of the newest question is kept."""
    case = CASES[name]
    clock = SteppedClock if name == "clock-step" else LoopClock
    script: Script = [
        (at_s, lambda stage, word=word: (stage.service.answer(word), None)[1])
        for at_s, word in ((case.clear_s, "clear"), (case.arm_s, "arm"))
        if at_s is not None
    ]
    return climb(case.back_s + 1.6, losses=case.losses, faults=case.faults, make_clock=clock, script=script)


def measure(name: str) -> Measured:
    """What the flight of a case shows."""
    case, flight = CASES[name], flown(name)
    errors = [
        (row.tai_s - T, row.beam_error_deg if row.beam_error_deg is not None else 180.0)
        for row in flight.rows
        if T + case.from_s <= row.tai_s <= T + case.back_s + 1.0
    ]
    off = [time_s for time_s, error_deg in errors if error_deg > ON_PATH_DEG and time_s > case.over_s]
    recovered_at_s = max(off, default=case.over_s)
    changes = [
        seen.state
        for before, seen in zip(flight.snapshots, flight.snapshots[1:], strict=False)
        if seen.state != before.state and T + case.from_s < seen.tai_s < T + case.back_s
    ]
    return Measured(
        states=tuple(changes),
        events=frozenset(event["event"] for event in flight.events),
        worst_deg=max(error_deg for time_s, error_deg in errors if time_s <= recovered_at_s + 0.1),
        recovered_s=recovered_at_s - case.over_s,
        after_deg=max(error_deg for time_s, error_deg in errors if time_s > recovered_at_s),
        end_state=flight.snapshots[-1].state,
        outside_count=outside_count(flight),
        burst_count=sum(1 for gap_s in write_gaps_s(flight) if gap_s < BURST_S - ROUNDING_S),
        stale_count=stale_count(flight),
    )


def sent_writes(flight: Flight) -> list[tuple[float, float, float]]:
    """Time, azimuth and elevation of every register write that was sent."""
    kinds = (WriteAndPoll, WriteRegisters)
    return [(tai_s, command.az_deg, command.el_deg) for tai_s, command in flight.commands if isinstance(command, kinds)]


def write_gaps_s(flight: Flight) -> list[float]:
    """Between writes of the path; a start's present angles go before the first."""
    times = [tai_s for tai_s, command in flight.commands if isinstance(command, WriteAndPoll)]
    return [b - a for a, b in zip(times, times[1:], strict=False)]


def outside_count(flight: Flight) -> int:
    """Commands outside the limits, or faster than the axis between two that the antenna follows."""
    acu = demo_target().station.acu
    az, el = acu.azimuth.limits(), acu.elevation.limits()
    followed = [row.tai_s for row in flight.rows if row.is_followed]
    followed_ticks = {round(tai_s * 10.0) for tai_s in followed}
    writes = sent_writes(flight)
    count = sum(1 for _, _, el_deg in writes if not el.min_deg - LSB_DEG <= el_deg <= el.max_deg + LSB_DEG)
    for before, after in zip(writes, writes[1:], strict=False):
        span_s = after[0] - before[0]
        if not {math.floor(before[0] * 10.0), math.floor(after[0] * 10.0)} <= followed_ticks or span_s > 0.35:
            continue
        az_deg, el_deg = abs(wrap_180(after[1] - before[1])), abs(after[2] - before[2])
        count += az_deg - LSB_DEG > az.max_rate_deg_s * span_s or el_deg - LSB_DEG > el.max_rate_deg_s * span_s
    return count


def stale_count(flight: Flight) -> int:
    """Register writes that the ACU applied long after they were sent."""
    sent: dict[tuple[int, int], list[float]] = defaultdict(list)
    for tai_s, az_deg, el_deg in sent_writes(flight):
        sent[round(az_deg / LSB_DEG) % 65536, round(el_deg / LSB_DEG)].append(tai_s)
    count = 0
    for write in flight.writes:
        key = round(write.az_deg % 360.0 / LSB_DEG) % 65536, round(write.el_deg / LSB_DEG)
        ages = [write.tai_s - t for t in sent[key] if t <= write.tai_s + 1e-6]
        count += bool(ages) and min(ages) > STALE_S
    return count

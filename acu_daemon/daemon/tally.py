"""What a daemon has done since its process began, through all its runs: counts and distributions, for other programs.

Adding is all that a tick pays.  Counters only rise; what they are called and in which unit they are shown is the affair
of whoever shows them (acu_daemon.outlets.metric_families).
"""

from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from acu_daemon.assist import reading_gate
from acu_daemon.control.orders import Event
from acu_daemon.control.tracking.state_table import AUTOTRACKING, HOLDING, Cause, TrackState
from acu_daemon.daemon.snapshot import Snapshot

LATENESS_S = (50e-6, 100e-6, 200e-6, 500e-6, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3, 100e-3)
ROUND_TRIP_S = (0.005, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.2, 0.5)
WRITE_GAP_S = (0.1, 0.11, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0)
RELOCK_S = (0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0)
LONGEST_STEP_S = 2.0  # between two snapshots: a longer one was no pass
SERVED_STEP_S = 60.0  # a gap between two writes that is longer was between two passes
TRAVEL_STEP_DEG = 0.1  # what is less is noise of the readings
LOSSES = {Cause.LOST: "lost", Cause.HIDDEN: "hidden", Cause.KEEP_OUT: "keep_out", Cause.ZENITH_NEAR: "zenith"}
LOSSES |= {Cause.LOCK_FALSE: "false_lock", Cause.MODE_LEFT: "mode_left", Cause.LINK_SILENT: "link"}

REJECTIONS = {
    reading_gate.DWELL: "dwell",
    reading_gate.OUT_OF_STEP: "out_of_step",
    reading_gate.ABOVE_MAX_ELEVATION: "above_max_elevation",
    reading_gate.OUTLIER: "outlier",
    reading_gate.ACCELERATION: "acceleration",
    reading_gate.CORRELATED: "correlated",
    reading_gate.SIDE_LOBE: "side_lobe",
    reading_gate.WRONG_TARGET: "wrong_target",
    reading_gate.OFF_PATH: "off_path",
    reading_gate.BELIED: "belied",
}


class Buckets:
    """A distribution: how many were at most as large as each bound, their sum and count."""

    def __init__(self, bounds: tuple[float, ...]) -> None:
        self.bounds = bounds
        self._counts = [0] * (len(bounds) + 1)
        self.total = 0.0

    def add(self, value: float) -> None:
        self._counts[bisect_left(self.bounds, value)] += 1
        self.total += value

    def cumulated(self) -> list[int]:
        """How many were at most as large as each bound, and how many there were."""
        found, so_far = [], 0
        for count in self._counts:
            so_far += count
            found.append(so_far)
        return found


@dataclass(frozen=True, slots=True)
class RunFigures:
    """What a run knows beside its snapshot; counts begin anew with each run."""

    connect_count: int = 0
    fit_count: int = 0
    fit_failed_count: int = 0
    permit_refusal_count: int = 0
    link_errors: Mapping[str, int] = field(default_factory=dict)
    elements_epoch_tai_s: float | None = None
    next_rise_tai_s: float | None = None
    beamwidth_deg: float = 0.0
    clock_error_s: float = 0.0
    sky_rate_deg_s: float = 0.0
    is_clock_synchronised: bool | None = None


class Tally:
    """Owned by the loop; one for the process."""

    def __init__(self) -> None:
        self.lateness = Buckets(LATENESS_S)
        self.round_trip = Buckets(ROUND_TRIP_S)
        self.write_gap = Buckets(WRITE_GAP_S)
        self.relock = Buckets(RELOCK_S)
        self.counts: Counter[tuple[str, str]] = Counter()  # by name and label
        self.seconds: Counter[str] = Counter()
        self.travel_deg: Counter[str] = Counter()
        self.checks: dict[str, bool] = {}
        self.seen: Snapshot | None = None
        self.figures = RunFigures()
        self._write_tai_s: float | None = None
        self._lost_tai_s: float | None = None
        self._run_counts: dict[tuple[str, str], int] = {}
        self._travelled_deg: dict[str, float] = {}

    def count(self, name: str, label: str = "", by: float = 1) -> None:
        """Count something, such as commands."""
        self.counts[name, label] += by  # type: ignore[assignment]

    def begin_run(self) -> None:
        """The counts of the run to come begin at 0."""
        self._run_counts.clear()

    def exchanged(self, took_s: float | None) -> None:
        """An exchange with the ACU; None: it brought no reply."""
        if took_s is not None:
            self.round_trip.add(took_s)

    def wrote(self, now_tai_s: float) -> None:
        """A register write was answered."""
        self.count("writes")
        if self._write_tai_s is not None and 0.0 < now_tai_s - self._write_tai_s < SERVED_STEP_S:
            self.write_gap.add(now_tai_s - self._write_tai_s)
        self._write_tai_s = now_tai_s

    @property
    def write_tai_s(self) -> float | None:
        """When the newest register write was answered."""
        return self._write_tai_s

    def told(self, event: Event, now_tai_s: float) -> None:
        """An event of the decision."""
        if event.name == "signal.lost":
            self._lost("lost", now_tai_s)
        elif event.name == "signal.locked":
            self._locked(now_tai_s)
        elif event.name == "fence.refused":
            self.count("refused", "permit")
        elif event.name == "state.changed":
            self._changed(str(event.fields["before"]), str(event.fields["state"]), event.fields["cause"], now_tai_s)

    def _changed(self, before: str, state: str, cause: object, now_tai_s: float) -> None:
        if state in AUTOTRACKING and before not in AUTOTRACKING:
            self._locked(now_tai_s)
        elif before in AUTOTRACKING and state not in AUTOTRACKING and state != TrackState.IDLE:
            self._lost(LOSSES.get(Cause(str(cause)), "other"), now_tai_s)
        elif state not in HOLDING and state != TrackState.SEARCH:
            self._lost_tai_s = None

    def _lost(self, cause: str, now_tai_s: float) -> None:
        self.count("losses", cause)
        self._lost_tai_s = now_tai_s

    def _locked(self, now_tai_s: float) -> None:
        if self._lost_tai_s is not None:
            self.relock.add(now_tai_s - self._lost_tai_s)
        self._lost_tai_s = None

    def see(self, seen: Snapshot, figures: RunFigures) -> None:
        """Take a snapshot, and what else its run knows."""
        before, self.seen, self.figures = self.seen, seen, figures
        self._follow("ticks", "", seen.tick_count)
        self._follow("skipped", "", seen.skipped_tick_count)
        self._follow("connects", "", figures.connect_count)
        self._follow("fits", "", figures.fit_count)
        self._follow("fits_failed", "", figures.fit_failed_count)
        self._follow("refused", "not_finite", seen.refusal_count - figures.permit_refusal_count)
        for reason, count in seen.rejected_counts.items():
            self._follow("rejected", REJECTIONS.get(reason, "other"), count)
        for reason, count in figures.link_errors.items():
            self._follow("link_errors", reason, count)
        step_s = 0.0 if before is None else seen.tai_s - before.tai_s
        if 0.0 < step_s <= LONGEST_STEP_S:
            self._pass(seen, step_s)
        self._travel("azimuth", seen.az_deg, 360.0)
        self._travel("elevation", seen.el_deg, None)

    def _pass(self, seen: Snapshot, step_s: float) -> None:
        if phase_of(seen) != "pass" or seen.is_hidden:
            return
        self.seconds["visible"] += step_s  # type: ignore[assignment]
        if seen.is_on_path:
            self.seconds["on_target"] += step_s  # type: ignore[assignment]

    def _travel(self, axis: str, angle_deg: float | None, turn_deg: float | None) -> None:
        if angle_deg is None:
            return
        way_deg = angle_deg - self._travelled_deg.setdefault(axis, angle_deg)
        if turn_deg is not None:
            way_deg -= turn_deg * round(way_deg / turn_deg)
        if abs(way_deg) >= TRAVEL_STEP_DEG:
            self.travel_deg[axis] += abs(way_deg)  # type: ignore[assignment]
            self._travelled_deg[axis] = angle_deg

    def _follow(self, name: str, label: str, count: int) -> None:
        """Add by how much a run's own count has risen."""
        key = name, label
        risen = count - self._run_counts.get(key, 0)
        if risen > 0:
            self.counts[key] += risen
            self._run_counts[key] = count


PREPASS_S = 120.0


def phase_of(seen: Snapshot) -> str:
    """idle, prepass or pass, by the pass in hand."""
    if seen.rise_in_s is None or seen.set_in_s is None or seen.set_in_s <= 0.0:
        return "idle"
    if seen.rise_in_s <= 0.0:
        return "pass"
    return "prepass" if seen.rise_in_s <= PREPASS_S else "idle"

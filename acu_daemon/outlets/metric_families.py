"""The daemon's metrics, as families of Prometheus: base units, counters in _total, times as POSIX timestamps.

Labels that are known are there from the start, at 0, so that a rate over them is never missing.  What is not known is
left out, and never shown as 0.  In a rehearsal times are told as if it were flown now: who looks has no other clock.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import isfinite

from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
    StateSetMetricFamily,
)
from prometheus_client.registry import Collector

from acu_daemon import __version__
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.operator_verbs import VERBS
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.tally import LOSSES, REJECTIONS, Buckets, Tally, phase_of
from acu_daemon.schedule.book import OVER
from acu_daemon.units import wrap_180

MODES = ("armed", "disarmed", "shadow")
PHASES = ("idle", "prepass", "pass")
OUTCOMES = tuple(map(str, OVER))
LINK_ERRORS = ("no_reply", "garbled", "discarded", "late", "doubted")
REFUSALS = ("not_finite", "permit", "acu")
ACTIONS = tuple(VERBS)
VIAS = ("cli", "page", "rotctl")
AXES = ("azimuth", "elevation")


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What is known beside the run: who has the lease ("" nobody), the wind and its limits, the disk."""

    lease_via: str = ""
    wind_m_s: tuple[float, float] | None = None  # ten-minute mean, gust
    wind_limits_m_s: tuple[float, float] | None = None
    disk_free_bytes: int | None = None


class DaemonCollector(Collector):
    """Makes the families of a tally.  now_unix_s: of its newest snapshot, by the clock that Prometheus has."""

    def __init__(self, tally: Tally, around: Surroundings, now_unix_s: float) -> None:
        self._tally, self._around, self._now_unix_s = tally, around, now_unix_s

    def collect(self) -> Iterable[Metric]:
        tally, seen = self._tally, self._tally.seen
        yield _gauge("acu_build_info", "The program's version; always 1.", {"version": __version__}, 1.0)
        yield from self._of_process()
        if seen is None:
            return
        yield from self._of_run(seen)
        yield from self._of_axes(seen)
        yield from self._of_signal(seen)
        yield from self._of_prediction(seen)
        yield from self._of_pass(seen)
        yield from _histograms(tally)

    def _unix_s(self, tai_s: float, seen: Snapshot) -> float:
        return self._now_unix_s - (seen.tai_s - tai_s)

    def _of_process(self) -> Iterator[Metric]:
        """What is counted through all runs."""
        counts, around = self._tally.counts, self._around
        for name, counted, what in (
            ("acu_readings", "readings", "Readings of the antenna that were believed."),
            ("acu_ticks", "ticks", "Ticks of the 10 Hz loop."),
            ("acu_ticks_skipped", "skipped", "Ticks that came too late and were left out."),
            ("acu_commands", "commands", "Commands sent to the ACU that change anything."),
            ("acu_writes", "writes", "Register writes that the ACU answered."),
            ("acu_fits", "fits", "Fits of the orbit that were accepted."),
            ("acu_fits_failed", "fits_failed", "Fits of the orbit that failed."),
        ):
            yield CounterMetricFamily(name, what, value=counts[counted, ""])
        connects = max(0, counts["connects", ""] - 1)
        yield CounterMetricFamily("acu_link_reconnects", "Connections to the ACU after the first.", value=connects)
        for name, counted, label, known, what in (
            ("acu_link_errors", "link_errors", "reason", LINK_ERRORS, "Replies of the ACU that were bad or missing."),
            ("acu_readings_rejected", "rejected", "reason", REJECTIONS.values(), "Locked readings kept from the fit."),
            ("acu_commands_refused", "refused", "reason", REFUSALS, "Commands that were kept back or refused."),
            ("acu_signal_losses", "losses", "cause", LOSSES.values(), "Times the signal was lost or left."),
            ("acu_passes", "passes", "outcome", OUTCOMES, "Passes of the schedule that are over."),
        ):
            yield self._counter(name, what, counted, label, known)
        yield self._pairs("acu_operator_actions", "What people and programs asked.", "actions", ("action", "via"))
        yield self._sources("acu_elements_fetches", "Times a source of elements was asked.", "fetches", ("source",))
        yield self._sources(
            "acu_elements_fetches_failed", "Times it gave nothing good.", "fetches_failed", ("source", "reason")
        )
        for name, kind, what in (
            ("acu_pass_visible", "visible", "Time that satellites of passes were up and not behind the mask."),
            ("acu_pass_on_target", "on_target", "Of that the time that the antenna was within half the beam."),
        ):
            yield CounterMetricFamily(f"{name}_seconds", what, value=self._tally.seconds[kind])
        travel = CounterMetricFamily("acu_axis_travel_degrees", "Way of an axis, by its readings.", labels=["axis"])
        for axis in AXES:
            travel.add_metric([axis], self._tally.travel_deg[axis])
        yield travel
        checks = GaugeMetricFamily("acu_check_passed", "Checks before the pass: 0 is a no-go.", labels=["check"])
        for check, is_passed in self._tally.checks.items():
            checks.add_metric([check], float(is_passed))
        yield checks
        held = GaugeMetricFamily("acu_lease_held", "Who has the write lease.", labels=["via"])
        for via in ("page", "rotctl"):
            held.add_metric([via], float(around.lease_via == via))
        yield held
        for name, pair, what in (
            ("acu_wind_speed", around.wind_m_s, "The newest wind that is known."),
            ("acu_wind_limit", around.wind_limits_m_s, "What stows the antenna."),
        ):
            if pair is not None:
                family = GaugeMetricFamily(f"{name}_meters_per_second", what, labels=["window"])
                family.add_metric(["mean"], pair[0])
                family.add_metric(["gust"], pair[1])
                yield family
        yield from _known("acu_disk_free_bytes", "Free on the disk of the state directory.", around.disk_free_bytes)

    def _counter(self, name: str, what: str, counted: str, label: str, known: Iterable[str]) -> Metric:
        family = CounterMetricFamily(name, what, labels=[label])
        counts = dict.fromkeys([*known, "other"] if counted in ("losses", "rejected") else known, 0.0)
        counts |= {key[1]: count for key, count in self._tally.counts.items() if key[0] == counted}
        for value, count in counts.items():
            family.add_metric([value], count)
        return family

    def _pairs(self, name: str, what: str, counted: str, labels: tuple[str, str]) -> Metric:
        family = CounterMetricFamily(name, what, labels=labels)
        counts = {f"{action} {via}": 0.0 for action in ACTIONS for via in VIAS}
        counts |= {key[1]: count for key, count in self._tally.counts.items() if key[0] == counted}
        for pair, count in counts.items():
            family.add_metric(pair.split(), count)
        return family

    def _sources(self, name: str, what: str, counted: str, labels: tuple[str, ...]) -> Metric:
        family = CounterMetricFamily(name, what, labels=labels)
        for (kind, label), count in self._tally.counts.items():
            if kind == counted:
                family.add_metric(label.split(), count)
        return family

    def _of_run(self, seen: Snapshot) -> Iterator[Metric]:
        figures, now = self._tally.figures, self._now_unix_s
        modes = {mode: mode == seen.arming for mode in MODES}
        modes |= {"rehearsal": seen.is_rehearsal, "simulation": seen.is_simulation}
        yield StateSetMetricFamily("acu_run_mode", "How it runs; several may be so.", value=modes)
        states = {str(state): str(state) == seen.state for state in TrackState}
        yield StateSetMetricFamily("acu_control_state", "What steers, and what would take over.", value=states)
        phases = {phase: phase == phase_of(seen) for phase in PHASES}
        yield StateSetMetricFamily("acu_pass_phase", "Where the pass in hand is.", value=phases)
        yield _gauge("acu_link_up", "Whether the connection to the ACU is open.", {}, float(seen.is_link_up))
        yield from _known(
            "acu_reading_timestamp_seconds",
            "When the newest reading was taken.",
            None if seen.reading_age_s is None else now - seen.reading_age_s,
        )
        write = self._tally.write_tai_s
        yield from _known(
            "acu_write_timestamp_seconds",
            "When the newest register write was answered.",
            None if write is None else self._unix_s(write, seen),
        )
        what = "How fast the satellite of the pass in hand moves."
        yield _gauge("acu_sky_rate_degrees_per_second", what, {}, figures.sky_rate_deg_s)
        yield _gauge("acu_clock_error_seconds", "System clock less the daemon's.", {}, figures.clock_error_s)
        synchronised = figures.is_clock_synchronised
        what = "Whether the system clock is synchronised."
        yield from _known("acu_clock_synchronized", what, None if synchronised is None else float(synchronised))
        epoch = figures.elements_epoch_tai_s
        if epoch is not None and seen.satellite:
            age = {"satellite": seen.satellite}
            what = "Epoch of the elements that the pass in hand is computed from."
            yield _gauge("acu_elements_epoch_timestamp_seconds", what, age, self._unix_s(epoch, seen))
        yield from _known("acu_sun_separation_degrees", "Between boresight and sun.", seen.sun_deg)
        stowed = GaugeMetricFamily("acu_stow_wanted", "Who wants the antenna stowed.", labels=["by"])
        for by in ("wind", "operator", "panel", "schedule"):
            stowed.add_metric([by], float(seen.stow_by == by))
        yield stowed

    def _of_axes(self, seen: Snapshot) -> Iterator[Metric]:
        measured = {"azimuth": seen.az_deg, "elevation": seen.el_deg}
        commanded = {"azimuth": seen.command_az_deg, "elevation": seen.command_el_deg}
        yield _per_axis("acu_axis_angle_degrees", "Measured angle, azimuth 0 to 360.", measured)
        yield _per_axis("acu_axis_command_degrees", "Angle written last, azimuth over all turns.", commanded)
        errors: dict[str, float | None] = dict.fromkeys(AXES)
        for axis, angle_deg in measured.items():
            command_deg = commanded[axis]
            if angle_deg is not None and command_deg is not None and seen.acu_mode in ("REMOTE", "REMOTE_BACKUP"):
                errors[axis] = wrap_180(command_deg - angle_deg)
        what = "The angle written last less the measured one, while the antenna follows it; the lead is in it."
        yield _per_axis("acu_axis_following_error_degrees", what, errors)
        is_both = bool(seen.latch) and not any(seen.latch.startswith(axis) for axis in AXES)
        latched = {axis: float(is_both or seen.latch.startswith(axis)) for axis in AXES}
        yield _per_axis("acu_axis_latched", "Whether it is stopped until a person clears it.", latched)

    def _of_signal(self, seen: Snapshot) -> Iterator[Metric]:
        what = "Where the antenna points beside the predicted path, on the sky."
        yield from _known("acu_beam_error_degrees", what, seen.off_path_deg)
        beamwidth = self._tally.figures.beamwidth_deg
        yield _gauge("acu_beamwidth_degrees", "Full width of the beam at half power.", {}, beamwidth)
        level = seen.signal_db if seen.signal_db is not None else seen.agc_db
        yield from _known("acu_signal_level_decibels", "Level of the receiver, of whatever it counts from.", level)
        yield _gauge("acu_signal_locked", "Whether the signal is acquired.", {}, float(seen.is_acquired))

    def _of_prediction(self, seen: Snapshot) -> Iterator[Metric]:
        what = "How far the prediction buffer reaches."
        yield _gauge("acu_prediction_buffer_seconds", what, {}, seen.buffer_s)
        what = "Until 3 sigma of the prediction leave half the beam."
        yield from _known("acu_prediction_trust_seconds", what, seen.inside_s)
        yield from _known("acu_prediction_sigma_degrees", "1 sigma of the predicted direction.", seen.sigma_deg)
        fit = None if seen.fit_age_s is None else self._now_unix_s - seen.fit_age_s
        yield from _known("acu_fit_timestamp_seconds", "Newest reading of the fit in force.", fit)
        what = "What the fit adds to the elements along the track, late positive."
        yield from _known("acu_correction_along_track_seconds", what, seen.along_s)
        what = "What it adds across the track, right positive."
        yield from _known("acu_correction_cross_track_degrees", what, seen.across_deg)

    def _of_pass(self, seen: Snapshot) -> Iterator[Metric]:
        rise = self._tally.figures.next_rise_tai_s
        what = "Rise of the pass in hand, or the next one."
        yield from _known(
            "acu_pass_next_start_timestamp_seconds", what, None if rise is None else self._unix_s(rise, seen)
        )


def _histograms(tally: Tally) -> Iterator[Metric]:
    for name, buckets, what in (
        ("acu_tick_lateness_seconds", tally.lateness, "How late the ticks began."),
        ("acu_link_round_trip_seconds", tally.round_trip, "From a command to its reply."),
        ("acu_write_gap_seconds", tally.write_gap, "Between two register writes that were answered."),
        ("acu_relock_seconds", tally.relock, "From a loss of the signal until it was back."),
    ):
        yield _histogram(name, what, buckets)


def _histogram(name: str, what: str, buckets: Buckets) -> Metric:
    family = HistogramMetricFamily(name, what)
    counts = buckets.cumulated()
    bounds = [*map(str, buckets.bounds), "+Inf"]
    family.add_metric([], list(zip(bounds, map(float, counts), strict=True)), buckets.total)
    return family


def _gauge(name: str, what: str, labels: dict[str, str], value: float) -> Metric:
    family = GaugeMetricFamily(name, what, labels=list(labels))
    family.add_metric(list(labels.values()), value)
    return family


def _known(name: str, what: str, value: float | None) -> Iterator[Metric]:
    """A gauge without labels, which has no sample where its value is not known."""
    family = GaugeMetricFamily(name, what)
    if value is not None and isfinite(value):
        family.add_metric([], value)
    yield family


def _per_axis(name: str, what: str, values: dict[str, float | None] | dict[str, float]) -> Metric:
    family = GaugeMetricFamily(name, what, labels=["axis"])
    for axis, value in values.items():
        if value is not None:
            family.add_metric([axis], value)
    return family

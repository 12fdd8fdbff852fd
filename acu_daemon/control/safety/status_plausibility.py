"""Whether a status is to be believed.  Pure.

A check byte of XOR passes two characters that changed alike, and two that changed places.  So a status that shows an
axis where no drive can have brought it counts only when the next one agrees, and one that contradicts itself, whose
mode may be anything, when half a second of them agree.
"""

from dataclasses import dataclass

from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.safety.axis_watch import sky_scale
from acu_daemon.model import AxisLimits
from acu_daemon.units import wrap_180

MOVED_COUNT, CONTRADICTING_COUNT = 2, 5  # in a row, before they are believed
SLACK_DEG = 1.0  # on the sky: noise, and more is left to the reading gate
RATE_MARGIN = 1.5  # of the drive's rate
CONFIRMED_COUNT = 3  # in a row show the antenna in one place: then it is there, and not garbled alike
CONFIRMED_DEG = 0.5  # between two of them, on the sky, where no satellite is faster in a tick


@dataclass(frozen=True, slots=True)
class Plausibility:
    """The last status that was believed, the last one that was not, and how many agree."""

    believed: tuple[float, AcuStatus] | None = None
    doubted: tuple[float, AcuStatus] | None = None
    agreeing_count: int = 0
    last: tuple[float, AcuStatus] | None = None
    steady_count: int = 0  # in a row, the last one among them
    doubted_count: int = 0  # in all
    reason: str = ""  # of a doubt about the last one, be it believed or not
    is_believed: bool = False  # the last one is

    @property
    def is_confirmed(self) -> bool:
        """Whether the place in the last status is sure: after a silence one alone proves little."""
        return self.steady_count >= CONFIRMED_COUNT


def judge(
    known: Plausibility,
    status: AcuStatus,
    tai_s: float,
    azimuth: AxisLimits,
    elevation: AxisLimits,
    within_s: float,
) -> Plausibility:
    """Judge the next status, sampled at an instant.  within_s: of each other two statuses confirm a place."""
    limits, now = (azimuth, elevation), (tai_s, status)
    is_steady = known.last is not None and _is_steady(known.last, status, tai_s, within_s)
    steady_count = 1 + (known.steady_count if is_steady else 0)
    wrong = status.contradictions
    reason = f"contradicts itself: {', '.join(wrong)}" if wrong else _moved(known.believed, status, tai_s, limits)
    if not reason:
        return Plausibility(now, None, 0, now, steady_count, known.doubted_count, "", True)
    is_agreeing = _agrees(known.doubted, status, wrong, tai_s, limits)
    agreeing_count = 1 + (known.agreeing_count if is_agreeing else 0)
    if agreeing_count < (CONTRADICTING_COUNT if wrong else MOVED_COUNT):
        count = known.doubted_count + 1
        return Plausibility(known.believed, now, agreeing_count, now, steady_count, count, reason, False)
    if not wrong:
        steady_count = 0  # where it has jumped to is to be confirmed by more than those two
    return Plausibility(now, now, agreeing_count, now, steady_count, known.doubted_count, reason, True)


def _agrees(
    doubted: tuple[float, AcuStatus] | None,
    status: AcuStatus,
    wrong: tuple[str, ...],
    tai_s: float,
    limits: tuple[AxisLimits, AxisLimits],
) -> bool:
    """Whether the last doubted status, just before this one, says the same."""
    return doubted is not None and doubted[1].contradictions == wrong and not _moved(doubted, status, tai_s, limits)


def _moved(
    before: tuple[float, AcuStatus] | None, status: AcuStatus, tai_s: float, limits: tuple[AxisLimits, AxisLimits]
) -> str:
    """Which axis moved further than its drive can; empty: none, or nothing is known of before."""
    if before is None:
        return ""
    span_s = max(tai_s - before[0], 0.0)
    az_deg = abs(wrap_180(status.az_deg - before[1].az_deg))
    el_deg = abs(status.el_deg - before[1].el_deg)
    az_slack_deg = SLACK_DEG / sky_scale(status.el_deg)
    for name, moved_deg, slack_deg, axis in (
        ("azimuth", az_deg, az_slack_deg, limits[0]),
        ("elevation", el_deg, SLACK_DEG, limits[1]),
    ):
        if moved_deg > slack_deg + RATE_MARGIN * axis.max_rate_deg_s * span_s:
            return f"{name} moved {moved_deg:.1f} deg in {span_s:.2f} s"
    return ""


def _is_steady(before: tuple[float, AcuStatus], status: AcuStatus, tai_s: float, within_s: float) -> bool:
    """Whether two in a row show the antenna in one place."""
    az_deg = abs(wrap_180(status.az_deg - before[1].az_deg)) * sky_scale(status.el_deg)
    el_deg = abs(status.el_deg - before[1].el_deg)
    return tai_s - before[0] <= within_s and max(az_deg, el_deg) <= CONFIRMED_DEG

"""Whether an encoder is frozen while the ACU autotracks: the same code while the satellite moves.  Pure.

The servo holds the satellite by its receiver then, so the antenna is right and only its readings are not: an alarm, and
nothing is fitted, but nothing is stopped.
"""

from dataclasses import dataclass

from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.safety.axis_watch import az_ends, el_ends, sky_scale
from acu_daemon.model import Pointing

FROZEN_DEG = 0.1  # 18 codes: so far must the satellite move, on the sky, under an encoder that shows the same one


@dataclass(frozen=True, slots=True)
class EncoderWatch:
    """The newest angles in autotrack, and how far the path has moved since each of them last changed."""

    tai_s: float | None = None
    az_deg: float = 0.0
    el_deg: float = 0.0
    az_moved_deg: float = 0.0
    el_moved_deg: float = 0.0

    @property
    def problem(self) -> str:
        """Which encoder is frozen, for people; empty: none."""
        if abs(self.az_moved_deg) > FROZEN_DEG:
            return "azimuth encoder frozen"
        return "elevation encoder frozen" if abs(self.el_moved_deg) > FROZEN_DEG else ""


def watch_encoders(watch: EncoderWatch, tai_s: float, status: AcuStatus, path: Pointing | None) -> EncoderWatch:
    """Take one more reading, and the path at its time; an axis at its limit may well stand.

    path: of the satellite that autotrack holds; None: it holds none, and the watch begins anew.
    """
    if path is None:
        return EncoderWatch()
    span_s = tai_s - watch.tai_s if watch.tai_s is not None else 0.0
    is_az_same = watch.tai_s is not None and status.az_deg == watch.az_deg and not any(az_ends(status))
    is_el_same = watch.tai_s is not None and status.el_deg == watch.el_deg and not any(el_ends(status))
    az_step_deg = path.az_rate_deg_s * span_s * sky_scale(path.el_deg)
    return EncoderWatch(
        tai_s,
        status.az_deg,
        status.el_deg,
        watch.az_moved_deg + az_step_deg if is_az_same else 0.0,
        watch.el_moved_deg + path.el_rate_deg_s * span_s if is_el_same else 0.0,
    )

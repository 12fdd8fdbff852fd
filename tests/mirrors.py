"""Mirrors of the whole decision: what it is given, and what it orders, seen in a mirror or turned round the vertical.

Left and right are alike for an antenna, and so are up and down as long as its limits are mirrored with it: cos(el) is
the same below the horizon.  So a tick that is given the mirrored world must order the mirrored commands.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from acu_daemon.acu.commands import PointAndPoll, PointAt
from acu_daemon.acu.replies import AcuStatus, Commanded
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tick_input import Asking, Exchange, NudgeWish, Observation, PassPlan, Sky, SlaveWish
from acu_daemon.model import AxisLimits, FitResult, Prediction, Reading
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.pointing.skyline import skyline_of


@dataclass(frozen=True)
class Mirror:
    """Signs of azimuth and elevation, and a turn of the azimuth, deg, that comes after."""

    az: int = 1
    el: int = 1
    turned_deg: float = 0.0

    def az_deg(self, az_deg: Any) -> Any:
        """Continuous."""
        return self.az * az_deg + self.turned_deg

    def limits(self, limits: AxisLimits, sign: int, turned_deg: float = 0.0) -> AxisLimits:
        ends = sorted((sign * limits.min_deg + turned_deg, sign * limits.max_deg + turned_deg))
        return replace(limits, min_deg=ends[0], max_deg=ends[1])

    def config(self, config: ControlConfig) -> ControlConfig:
        return replace(config, envelope=self.envelope(config.envelope))

    def envelope(self, envelope: Envelope) -> Envelope:
        """With all that it holds; a skyline has no mirror up and down."""
        skyline, stow_deg, sun = envelope.skyline, envelope.stow_deg, envelope.sun
        if skyline is not None:
            points = zip(skyline.az_deg, skyline.el_deg, strict=True)
            skyline = skyline_of(tuple((self.az_deg(az_deg) % 360.0, el_deg) for az_deg, el_deg in points))
        return replace(
            envelope,
            azimuth=self.limits(envelope.azimuth, self.az, self.turned_deg),
            elevation=self.limits(envelope.elevation, self.el),
            keep_outs=tuple(map(self.keep_out, envelope.keep_outs)),
            sun=sun if sun is None else sun.mirrored(self),
            skyline=skyline,
            stow_deg=None if stow_deg is None else (self.az_deg(stow_deg[0]), self.el * stow_deg[1]),
        )

    def keep_out(self, box: KeepOut) -> KeepOut:
        az_deg = [self.az_deg(one) for one in (box.az_from_deg, box.az_to_deg)][:: self.az]
        return replace(
            box,
            **dict(zip(("az_from_deg", "az_to_deg"), az_deg, strict=True)),
            **dict(
                zip(
                    ("el_from_deg", "el_to_deg"),
                    sorted((self.el * box.el_from_deg, self.el * box.el_to_deg)),
                    strict=True,
                )
            ),
        )

    def asking(self, asking: Asking) -> Asking:
        if isinstance(asking, NudgeWish):
            return replace(asking, across_deg=self.az * self.el * asking.across_deg)
        if isinstance(asking, SlaveWish) and asking.az_deg is not None and asking.el_deg is not None:
            return replace(asking, az_deg=self.az_deg(asking.az_deg) % 360.0, el_deg=self.el * asking.el_deg)
        return asking

    def status(self, status: AcuStatus) -> AcuStatus:
        ends = {"is_at_cw_limit": status.is_at_cw_limit, "is_at_ccw_limit": status.is_at_ccw_limit}
        if self.az < 0:
            ends = {"is_at_cw_limit": status.is_at_ccw_limit, "is_at_ccw_limit": status.is_at_cw_limit}
            ends["is_sector_high"] = not status.is_sector_high
        ends |= {"is_at_up_limit": status.is_at_up_limit, "is_at_down_limit": status.is_at_down_limit}
        if self.el < 0:
            ends |= {"is_at_up_limit": status.is_at_down_limit, "is_at_down_limit": status.is_at_up_limit}
        return replace(status, az_deg=self.az_deg(status.az_deg) % 360.0, el_deg=self.el * status.el_deg, **ends)

    def reading(self, reading: Reading) -> Reading:
        return replace(reading, az_deg=self.az_deg(reading.az_deg) % 360.0, el_deg=self.el * reading.el_deg)

    def message(self, message: Any) -> Any:
        """A command, or a reply."""
        if isinstance(message, PointAndPoll | PointAt):
            return replace(message, az_deg=self.az_deg(message.az_deg), el_deg=self.el * message.el_deg)
        if isinstance(message, Commanded):
            return replace(message, az_deg=self.az_deg(message.az_deg) % 360.0, el_deg=self.el * message.el_deg)
        return message

    def seen(self, seen: Observation) -> Observation:
        extra = seen.extra
        return replace(
            seen,
            status=None if seen.status is None else self.status(seen.status),
            reading=None if seen.reading is None else self.reading(seen.reading),
            extra=None if extra is None else Exchange(self.message(extra.command), self.message(extra.reply)),
            requests=tuple(map(self.asking, seen.requests)),
        )

    def prediction(self, seen: Prediction) -> Prediction:
        drift, crossing = seen.late_drift_deg_s, seen.crossing
        if crossing is not None:
            crossing = replace(
                crossing,
                departure_az_deg=self.az_deg(crossing.departure_az_deg),
                departure_rate_deg_s=self.az * crossing.departure_rate_deg_s,
            )
        return replace(
            seen,
            az_deg=self.az_deg(seen.az_deg),
            el_deg=self.el * seen.el_deg,
            az_rate_deg_s=self.az * seen.az_rate_deg_s,
            el_rate_deg_s=self.el * seen.el_rate_deg_s,
            follow_az_deg=self.az_deg(seen.follow_az_deg),
            follow_az_rate_deg_s=self.az * seen.follow_az_rate_deg_s,
            crossing=crossing,
            late_drift_deg_s=None if drift is None else np.array([[self.az], [self.el]]) * drift,
        )

    def fit(self, fit: FitResult) -> FitResult:
        return replace(fit, across_deg=self.az * self.el * fit.across_deg)

    def plan(self, plan: PassPlan) -> PassPlan:
        return replace(plan, start_az_deg=self.az_deg(plan.start_az_deg), start_el_deg=self.el * plan.start_el_deg)

    def sky(self, sky: Sky) -> Sky:
        return Sky(
            None if sky.prediction is None else self.prediction(sky.prediction),
            None if sky.fit is None else self.fit(sky.fit),
            None if sky.plan is None else self.plan(sky.plan),
        )


MIRRORS = {"left and right": Mirror(az=-1), "up and down": Mirror(el=-1), "turned by 110 deg": Mirror(turned_deg=112.5)}

"""What the background does each time: new readings in, a fit and a fresh prediction buffer out.  Pure.

The same object runs in the child process, inline in virtual time, and in a replay.
"""

from dataclasses import dataclass
from functools import partial

from acu_daemon.assist.estimator import Estimator, EstimatorSettings, make_estimator
from acu_daemon.assist.prediction import predict
from acu_daemon.model import AxisLimits, FitResult, Prediction, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.keyhole import follow_path, longest_window_s


@dataclass(frozen=True, slots=True)
class RefitSetup:
    """Everything that stays the same during a pass; it is sent to the child process once."""

    propagator: Propagator
    site: Site
    estimator: str
    settings: EstimatorSettings
    azimuth: AxisLimits
    step_s: float = 0.1


@dataclass(frozen=True, slots=True)
class RefitRequest:
    """New locked readings, oldest first, and the span wanted."""

    readings: Readings
    start_tai_s: float
    horizon_s: float
    now_tai_s: float
    near_az_deg: float  # picks the turn of the azimuth at the start of the buffer


@dataclass(frozen=True, slots=True)
class RefitReply:
    """The newest fit, None before the first one is possible, and the buffer made from it."""

    fit: FitResult | None
    prediction: Prediction


class Refitter:
    """An estimator and the orbit it corrects.  Owned by one task."""

    def __init__(self, setup: RefitSetup) -> None:
        self._setup = setup
        self._estimator: Estimator = make_estimator(setup.estimator, setup.propagator, setup.site, setup.settings)

    def refit(self, request: RefitRequest) -> RefitReply:
        """Take new readings, fit, and predict from the corrected orbit, or from the elements before any fit.

        Raises: OrbitError: the propagator has no answer for the span.
        """
        if len(request.readings):
            self._estimator.add(request.readings)
        fit = self._estimator.fit()
        setup = self._setup
        propagator = setup.propagator if fit is None else setup.propagator.corrected(fit.correction)
        prediction = predict(
            propagator,
            setup.site,
            request.start_tai_s,
            made_at_tai_s=request.now_tai_s,
            kind="TLE" if fit is None else "FITTED",
            horizon_s=request.horizon_s,
            step_s=setup.step_s,
            near_az_deg=request.near_az_deg,
            lead_in_s=longest_window_s(setup.azimuth),
            follow=partial(follow_path, azimuth=setup.azimuth),
            fit=fit,
        )
        return RefitReply(fit, prediction)

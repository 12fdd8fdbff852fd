"""What the background does each time: new readings in, a fit and a fresh prediction buffer out.  Pure.

The same object runs in the child process, inline in virtual time, and in a replay.
"""

from dataclasses import dataclass
from functools import partial

from acu_daemon.assist.carry_over import CarryOver, aged_prior, first_fit
from acu_daemon.assist.estimator import Estimator, EstimatorSettings, has_covariance, make_estimator
from acu_daemon.assist.prediction import predict
from acu_daemon.model import AxisLimits, FitResult, Prediction, PredictionKind, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.keyhole import follow_path, longest_window_s


@dataclass(frozen=True, slots=True)
class RefitSetup:
    """Everything that stays the same during a pass; it is sent to the child process once.

    carried: what an earlier pass left, accepted (assist.carry_over); only estimators with a covariance use it.
    """

    propagator: Propagator
    site: Site
    estimator: str
    settings: EstimatorSettings
    azimuth: AxisLimits
    step_s: float = 0.1
    carried: CarryOver | None = None


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
    """The newest fit, None before the first one is possible, the buffer made from it, and what people should know."""

    fit: FitResult | None
    prediction: Prediction
    notes: tuple[str, ...] = ()


class Refitter:
    """An estimator and the orbit it corrects.  Owned by one task."""

    def __init__(self, setup: RefitSetup) -> None:
        self._setup = setup
        self._estimator: Estimator = make_estimator(
            setup.estimator, setup.propagator, setup.site, setup.settings, setup.carried
        )

    def refit(self, request: RefitRequest) -> RefitReply:
        """Take new readings, fit, and predict from the corrected orbit.

        Before the first fit the orbit is what an earlier pass left, else the elements' own.

        Raises: OrbitError: the propagator has no answer for the span.
        """
        if len(request.readings):
            self._estimator.add(request.readings)
        fit = self._estimator.fit()
        setup = self._setup
        notes, self._estimator.notes[:] = tuple(self._estimator.notes), ()
        shown = self._before_fit(request.now_tai_s) if fit is None else fit
        prediction = predict_from(setup, shown, request, kind="TLE" if fit is None else "FITTED")
        return RefitReply(fit, prediction, notes)

    def _before_fit(self, now_tai_s: float) -> FitResult | None:
        setup = self._setup
        if setup.carried is None or not has_covariance(setup.estimator):
            return None
        prior = aged_prior(setup.carried, setup.propagator, setup.site, setup.settings, now_tai_s)
        return first_fit(setup.carried, prior)


def predict_from(setup: RefitSetup, fit: FitResult | None, request: RefitRequest, kind: PredictionKind) -> Prediction:
    """Make the buffer from the orbit that a fit found, or from the elements alone.

    Raises: OrbitError: the propagator has no answer for the span.
    """
    return predict(
        setup.propagator if fit is None else setup.propagator.corrected(fit.correction),
        setup.site,
        request.start_tai_s,
        made_at_tai_s=request.now_tai_s,
        kind=kind,
        horizon_s=request.horizon_s,
        step_s=setup.step_s,
        near_az_deg=request.near_az_deg,
        lead_in_s=longest_window_s(setup.azimuth),
        follow=partial(follow_path, azimuth=setup.azimuth),
        fit=fit,
    )

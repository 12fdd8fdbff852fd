"""The `full` estimator: six orbit corrections, angle biases and the station's place, with their covariance.  Pure."""

from dataclasses import fields, replace

import numpy as np

from acu_daemon.assist.estimators.estimator_base import BaseEstimator, on_the_sky_deg, right_of_track
from acu_daemon.assist.estimators.full.aged_prior import aged_prior
from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.assist.estimators.full.carry_over_test import REJECTED_S, WIDEST_SIGMAS, CarryOverTest
from acu_daemon.assist.estimators.full.elements_discrepancy import describe_discrepancy
from acu_daemon.assist.estimators.full.estimated_states import Prior, bias_of, correction_of, make_prior, shift_of
from acu_daemon.assist.estimators.full.least_squares import Batch, Solution, solve
from acu_daemon.assist.estimators.full.normal_points import Sights, sights
from acu_daemon.assist.estimators.full.pedestal_prior import LOG_ODDS, Doubt, PedestalPrior, doubt_of, with_shift
from acu_daemon.assist.estimators.full.prior_inflation import WIDTHS, is_strained, most_likely
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Correction, FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG

_NEWEST_COUNT = 30
SURE_AGAIN = 2.0  # by so much, in its logarithm, the memory must be likelier to be used again
TRUSTED_AGAIN = "the encoders are as the last passes had them: the memory of them is used again"
_RETRY_SHARE = 1.3  # so many more readings until another widening is tried


class FullEstimator(BaseEstimator):
    """Weighted least squares of all readings with a prior, behind the `Estimator` protocol (full.least_squares)."""

    name = "full"

    def __init__(
        self,
        propagator: Propagator,
        site: Site,
        settings: EstimatorSettings,
        carried: CarryOver | None = None,
        *,
        may_widen: bool = False,
        pedestal: PedestalPrior | None = None,
    ) -> None:
        """Take what an earlier pass left; it is dropped, with a note, when a minute of readings rejects it.

        pedestal: what earlier passes, of any satellite, showed of it; set aside, with a note, while the readings are
        likelier with encoders that were re-zeroed.

        may_widen: elements are worth less, with a note, when the readings show them to be far worse than they should
        be; only for readings that are known to be the satellite's.
        """
        super().__init__(propagator, site, settings)
        self._carried = carried
        self._pedestal = pedestal
        self._is_rezeroed = False
        self.pedestal_notes: list[str] = []  # what people should be told of the memory of the pedestal
        self._carry_over_test: CarryOverTest | None = None
        self._batch: Batch | None = None
        self._parts: list[Sights] = []
        self._solution: Solution | None = None
        self._is_new = False
        self._fit: FitResult | None = None  # to all readings so far
        self._may_widen = may_widen
        self._width = 0  # of prior_inflation.WIDTHS
        self._next_try_count = 0

    def add(self, readings: Readings) -> None:
        self._fit = None
        super().add(readings)

    def _use(self, readings: Readings) -> list[str | None]:
        seen = sights(readings)
        if self._batch is None:
            self._start(float(readings.tai_s[0]))
        if self._carry_over_test is not None and self._carry_over_test.rejects(seen):
            self._carried = self._carry_over_test = None
            self._start(float((self._parts or [seen])[0].tai_s[0]))
            self.notes.append(
                f"the last pass's orbit is dropped: for {REJECTED_S:g} s all readings were more than {WIDEST_SIGMAS:g} "
                "sigma from it, as after a manoeuvre"
            )
        self._parts.append(seen)
        self._is_new = True
        return [None] * len(readings)

    def _start(self, first_tai_s: float) -> None:
        """Begin with what is known before the first reading, the one at first_tai_s."""
        self._solution = None
        noise = None if self._doubted is None else self._doubted.noise
        self._batch = Batch(self._source, self._site, self._settings, self._prior(first_tai_s), noise)
        if self._carried is not None:
            self._carry_over_test = CarryOverTest(self._source, self._site, self._settings, self._batch.prior)

    def _prior(self, at_tai_s: float) -> Prior:
        if self._carried is None:
            prior = make_prior(self._source, self._settings, at_tai_s)
            return prior if self._pedestal is None else self._pedestal.of(prior)
        return aged_prior(self._carried, self._source, self._site, self._settings, at_tai_s, self._pedestal)

    @property
    def _doubted(self) -> PedestalPrior | None:
        """What the readings are asked to deny; nothing in a pass that is gone on with: its fit has them in it."""
        return None if self._carried is not None and self._carried.is_of_this_pass else self._pedestal

    def _correction(self) -> Correction | None:
        return None if self._solution is None else correction_of(self._solution.x)

    def fit(self) -> FitResult | None:
        """Give the fit to all readings so far; None before the first.

        Raises:  OrbitError: the source has no answer for one of the readings' times.
        """
        if self._batch is not None and self._fit is None:
            seen = _joined(self._parts)
            self._parts = [seen]
            if self._is_new or self._solution is None:
                self._solution = self._solve(self._batch, seen)
                self._is_new = False
            self._fit = self._result(self._solution, float(seen.tai_s[-1]))
        return self._fit

    def _solve(self, batch: Batch, seen: Sights) -> Solution:
        """Solve with what is known of the pedestal, or, where that is less likely, with encoders re-zeroed since.

        That is asked first: else re-zeroed encoders would look like elements that are worse than they are.
        """
        pedestal = self._doubted
        if pedestal is None:
            return self._widened(batch, seen, solve(WIDTHS[self._width].of(batch), seen, self._solution))
        rezeroed = replace(batch, prior=pedestal.rezeroed.of(batch.prior))
        before = self._is_rezeroed
        solution = solve(WIDTHS[self._width].of(rezeroed if before else batch), seen, self._solution)
        doubt = doubt_of(pedestal, solution.x, solution.covariance, is_rezeroed=before)
        self._is_rezeroed = doubt.log_evidence + LOG_ODDS > (-SURE_AGAIN if before else 0.0)
        batch = rezeroed if self._is_rezeroed else batch
        if before is not self._is_rezeroed:
            self.pedestal_notes.append(_why_rezeroed(doubt) if self._is_rezeroed else TRUSTED_AGAIN)
            solution = solve(WIDTHS[self._width].of(batch), seen, solution)
        elif not before and self._explains_strain(doubt, rezeroed, solution):
            return solution
        return self._widened(batch, seen, solution)

    def _explains_strain(self, doubt: Doubt, rezeroed: Batch, solution: Solution) -> bool:
        """Whether re-zeroed encoders are as good a reason as worse elements: then more readings decide, no width."""
        if self._pedestal is None or doubt.log_evidence <= 0.0:
            return False
        shifted = replace(solution, x=with_shift(self._pedestal, solution.x, solution.covariance, doubt))
        return not is_strained(WIDTHS[self._width].of(rezeroed), shifted)

    @property
    def seen(self) -> Sights | None:
        """All readings so far, geometric."""
        self._parts = [_joined(self._parts)] if self._parts else []
        return self._parts[0] if self._parts else None

    def _widened(self, batch: Batch, seen: Sights, solution: Solution) -> Solution:
        """The solution, or one with elements that are worth less, where the readings show that."""
        given = WIDTHS[self._width].of(batch)
        may_widen = self._may_widen and self._carried is None and seen.tai_s.size >= self._next_try_count
        if not may_widen or not is_strained(given, solution):
            return solution
        self._next_try_count = int(_RETRY_SHARE * seen.tai_s.size)
        solution, width = most_likely(batch, self._width, seen, solution)
        if width > self._width:
            self._width = width
            self.notes.append(self._why_far(solution, float(seen.tai_s[-1])))
        return solution

    def _why_far(self, solution: Solution, at_tai_s: float) -> str:
        correction, bias = correction_of(solution.x), bias_of(solution.x)
        shift = shift_for_people(self._source, correction, at_tai_s, self._site)
        return describe_discrepancy(self._source, self._settings, correction, bias, shift, at_tai_s)

    def _result(self, solution: Solution, at_tai_s: float) -> FitResult:
        left_out = int(np.count_nonzero(solution.left.weights == 0.0))
        newest = solution.left.off_rad[:, -_NEWEST_COUNT:]
        correction = correction_of(solution.x)
        along_s, across_deg = shift_for_people(self._source, correction, at_tai_s, self._site)
        return FitResult(
            estimator=self.name,
            correction=correction,
            at_tai_s=at_tai_s,
            reading_count=self.used_count - left_out,
            rejected_count=len(self.rejected) + left_out,
            residual_rms_deg=float(np.sqrt(np.mean(np.sum(newest**2, axis=0)))) / DEG,
            along_s=along_s,
            across_deg=across_deg,
            bias=bias_of(solution.x),
            station_shift_enu_m=shift_of(solution.x),
            covariance=solution.covariance,
        )


def _why_rezeroed(doubt: Doubt) -> str:
    ia_deg, ie_deg = doubt.shift_rad / DEG
    return (
        f"the encoders seem to have been re-zeroed since the last passes, by {ia_deg:+.2f} deg in azimuth and "
        f"{ie_deg:+.2f} in elevation: the memory of them is set aside"
    )


def _joined(parts: list[Sights]) -> Sights:
    if len(parts) == 1:
        return parts[0]
    return Sights(*(np.concatenate([getattr(one, item.name) for one in parts]) for item in fields(Sights)))


def shift_for_people(source: Propagator, correction: Correction, tai_s: float, site: Site) -> tuple[float, float]:
    """Show a correction as the whole move of the satellite at tai_s: seconds late (+), degrees across the track.

    across_deg: as an angle on the sky of the station at that instant, right of the inertial motion positive.
    """
    at = np.array([tai_s])
    (r0, v0), (r1, v1) = (one.states_teme(at) for one in (source, source.corrected(correction)))
    r, v, move = r1[0], v1[0], (r1 - r0)[0]
    right, middle = right_of_track(r, v), (v0[0] + v) / 2.0
    along_s = -float(move @ middle) / float(middle @ middle)
    return along_s, on_the_sky_deg(float(move @ right), right, r, tai_s, site)

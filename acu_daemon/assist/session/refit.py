"""What the background does each time: new readings in, a fit and a fresh prediction buffer out.  Pure.

The same object runs in the child process, inline in virtual time, and in a replay.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from acu_daemon.assist.estimators.estimator import Estimator, EstimatorSettings, has_covariance, make_estimator
from acu_daemon.assist.estimators.full.aged_prior import aged_prior, first_fit
from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator, shift_for_people
from acu_daemon.assist.estimators.full.pedestal_prior import PedestalPrior
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory, prior_of
from acu_daemon.assist.mount_memory.whole_pass import LEAST_S, PassEstimate, estimate_pass
from acu_daemon.assist.reading_gate import OUTLIER
from acu_daemon.assist.screening.track_gate import TrackGate
from acu_daemon.assist.session.model_choice import ModelChoice, choose, is_good, newest_residual_deg
from acu_daemon.assist.session.prediction import predict
from acu_daemon.assist.session.prediction_spread import spread_of
from acu_daemon.model import AxisLimits, FitResult, Model, Prediction, Readings, Site, ZenithCrossing
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.keyhole import KeyholeRules, Objective, longest_window_s

BATCH_S = 1.0  # readings are judged by the fit to those before them: so many at a time
BATCH_SHARE = 0.1  # or this share of what was taken already, such as when a new child is given a whole pass
RESTART_S = 30.0  # a fit that is bad again and again starts afresh with the newest readings
CARRIED_S = 10.0  # so long its readings must contradict what it began with
ESTIMATE_SHARE = 0.1  # what a pass says of the pedestal is reckoned again with so many more seconds of readings
DROPPED = "the last pass's orbit is dropped: the fits that began with it stayed far from the newest readings"


@dataclass(frozen=True, slots=True)
class RefitSetup:
    """Everything that stays the same during a pass; it is sent to the child process once.

    carried: what an earlier pass left and was accepted, which only estimators with a covariance use; or
    the fit of this pass that the daemon had when it was started again: it goes on from it.
    may_plunge: the elevation axis goes over the top, and the antenna may be led so.
    memory: what the station knows of its antenna; None: no such thing is kept, the configuration says it all.
    """

    propagator: Propagator
    site: Site
    estimator: str
    settings: EstimatorSettings
    azimuth: AxisLimits
    step_s: float = 0.1
    carried: CarryOver | None = None
    zenith_objective: Objective = "largest_error"
    memory: PedestalMemory | None = None
    may_plunge: bool = False

    @property
    def keyhole(self) -> KeyholeRules:
        """What the antenna can do near the zenith."""
        max_el_deg = 90.0 if self.settings.elevation is None else min(self.settings.elevation.max_deg, 90.0)
        half_beam_deg = self.settings.beamwidth_deg / 2.0
        return KeyholeRules(self.azimuth, max_el_deg, self.may_plunge, half_beam_deg, self.zenith_objective)

    @property
    def is_resumed(self) -> bool:
        """Whether this pass had a fit already."""
        return self.carried is not None and self.carried.is_of_this_pass


@dataclass(frozen=True, slots=True)
class RefitRequest:
    """New locked readings, oldest first, and the span wanted."""

    readings: Readings
    start_tai_s: float
    horizon_s: float
    now_tai_s: float
    near_az_deg: float  # picks the turn of the azimuth at the start of the buffer
    zenith_turn: int = 0  # past the zenith the azimuth rises (1), falls (-1), or as the path does
    in_hand: ZenithCrossing | None = None  # the crossing of the zenith that the antenna is on, or is about to begin
    may_plunge: bool = True  # over the top, where the antenna can: the mode it is in lets it
    is_plunged: bool = False  # it is beyond the zenith


@dataclass(frozen=True, slots=True)
class GateVerdict:
    """Why the newest readings are left out ("" when they are kept), and how many were so far, by reason."""

    rejecting: str = ""
    counts: dict[str, int] = field(default_factory=dict)
    reset_count: int = 0  # how often what was believed gave way to newer readings


@dataclass(frozen=True, slots=True)
class RefitReply:
    """The newest fit, the buffer, and what people should know.  The fit is None while another model is in use.

    estimate: what the pass says of the pedestal so far, where that is new.
    """

    fit: FitResult | None
    prediction: Prediction
    notes: tuple[str, ...] = ()
    model: Model = Model.ELEMENTS
    gate: GateVerdict = GateVerdict()
    estimate: PassEstimate | None = None


class Refitter:
    """An estimator, the gate before it, and the orbit they correct.  Owned by one task."""

    def __init__(self, setup: RefitSetup) -> None:
        self._setup = setup
        self._carried = setup.carried
        self._resumed = before_fit(setup, setup.carried.at_tai_s) if setup.carried and setup.is_resumed else None
        self._gate = TrackGate(setup.propagator, setup.site, setup.settings)
        self._choice = ModelChoice()
        self._said: set[str] = set()
        self._pedestal: PedestalPrior | None = None
        self._estimated_to_tai_s = self._estimated_span_s = 0.0
        self._begin_fit()

    def refit(self, request: RefitRequest) -> RefitReply:
        """Take new readings, fit, and predict from the model that the newest readings prefer.

        Raises: OrbitError: the propagator has no answer for the span.
        """
        memory = self._setup.memory
        if self._pedestal is None and memory is not None and memory.pass_count:
            self._pedestal = prior_of(memory, self._setup.settings, request.now_tai_s)
            self._begin_fit()
        for batch in self._batches(request.readings):
            self._take(batch)
        notes = self._take_notes()
        models = self._models(request.now_tai_s)
        self._choose(models, has_news=len(request.readings) > 0)
        if self._choice.is_reset_due and (self._carried is None or self._gate.kept.span_s >= CARRIED_S):
            notes += self._drop_carried()
            self._gate.restart(RESTART_S)
            self._begin_fit()
            models = self._models(request.now_tai_s)
            self._choose(models, has_news=True)
        return replace(self._reply(request, models, notes), estimate=self._estimate(has_news=len(request.readings) > 0))

    def _batches(self, readings: Readings) -> Iterator[Readings]:
        while len(readings):
            is_now = readings.tai_s < readings.tai_s[0] + max(BATCH_S, BATCH_SHARE * self._gate.kept.span_s)
            yield readings.part(is_now)
            readings = readings.part(~is_now)

    def _take(self, batch: Readings) -> None:
        reset_count = self._gate.reset_count
        taken = self._gate.take(batch, self._judge.fit())
        if self._gate.reset_count > reset_count:
            self._forget_resumed()
        if taken is None:
            self._begin_fit()
        elif len(taken):
            for estimator in self._estimators:
                estimator.add(taken)

    def _drop_carried(self) -> tuple[str, ...]:
        """A fresh start that began with the same orbit would end as badly."""
        is_last_pass = self._carried is not None and self._resumed is None
        self._carried = self._resumed = None
        return (DROPPED,) if is_last_pass else ()

    def _forget_resumed(self) -> None:
        """What this pass's newer readings contradict is not gone on from."""
        if self._resumed is not None:
            self._resumed = self._carried = None

    def _begin_fit(self) -> None:
        """Make the estimator afresh, and one for the gate, which needs a sigma, and give them the kept readings."""
        setup = self._setup
        what = (setup.propagator, setup.site, setup.settings)
        self._estimator: Estimator = make_estimator(setup.estimator, *what, self._carried, self._pedestal)
        self._judge: FullEstimator = (
            self._estimator
            if isinstance(self._estimator, FullEstimator)
            else FullEstimator(*what, may_widen=True, pedestal=self._pedestal)
        )
        self._estimators = [self._estimator] if self._judge is self._estimator else [self._estimator, self._judge]
        if len(self._gate.kept):
            for estimator in self._estimators:
                estimator.add(self._gate.kept)

    def _take_notes(self) -> tuple[str, ...]:
        notes, self._estimator.notes[:] = tuple(self._estimator.notes), ()
        if notes:  # the readings rejected what was carried over
            self._carried = self._resumed = None
        notes, self._judge.pedestal_notes[:] = (*notes, *self._judge.pedestal_notes), ()
        new = tuple(note for note in notes if note not in self._said)  # an estimator made afresh finds the same again
        self._said.update(new)
        return new

    def _estimate(self, *, has_news: bool) -> PassEstimate | None:
        """What the pass says of the pedestal, where it has gone on by a tenth, or readings have stopped coming."""
        setup, kept = self._setup, self._gate.kept
        if setup.memory is None or len(kept) == 0 or self._judge.seen is None:
            return None
        last, span_s = float(kept.tai_s[-1]), float(kept.tai_s[-1] - kept.tai_s[0])
        is_due = span_s - self._estimated_span_s >= max(LEAST_S / 2.0, ESTIMATE_SHARE * span_s)
        if span_s < LEAST_S or last == self._estimated_to_tai_s or (has_news and not is_due):
            return None
        self._estimated_to_tai_s, self._estimated_span_s = last, span_s
        return estimate_pass(setup.propagator, setup.site, setup.settings, setup.memory, self._judge.seen)

    def _models(self, now_tai_s: float) -> dict[Model, FitResult | None]:
        """The models there are, each with what it adds to the elements."""
        models: dict[Model, FitResult | None] = {Model.ELEMENTS: None}
        if self._carried is not None and self._resumed is None:
            last_pass = before_fit(self._setup, now_tai_s)
            if last_pass is not None:
                models[Model.LAST_PASS] = last_pass
        fit = self._estimator.fit() or self._resumed
        if fit is not None:
            models[Model.NEW_FIT] = fit
        return models

    def _choose(self, models: dict[Model, FitResult | None], *, has_news: bool) -> None:
        kept, setup = self._gate.kept, self._setup
        if len(kept) == 0:
            self._choice = ModelChoice(list(models)[-1])
        elif has_news:
            noise_deg = max(setup.settings.sigma_azimuth_deg, setup.settings.sigma_elevation_deg)
            residuals_deg: dict[Model, float] = {}
            for model in sorted(models, key=lambda one: one is not Model.NEW_FIT):  # the others only if it is not good
                residuals_deg[model] = newest_residual_deg(setup.propagator, setup.site, models[model], kept)
                if model is Model.NEW_FIT and is_good(residuals_deg[model], noise_deg):
                    break
            self._choice = choose(self._choice, residuals_deg, noise_deg)

    def _reply(
        self, request: RefitRequest, models: dict[Model, FitResult | None], notes: tuple[str, ...]
    ) -> RefitReply:
        model, fit = self._choice.model, models.get(Model.NEW_FIT)
        counts = self._gate.counts
        if fit is not None:
            if fit.rejected_count:
                counts[OUTLIER] = counts.get(OUTLIER, 0) + fit.rejected_count
            fit = replace(fit, rejected_count=sum(counts.values()))
        prediction = predict_from(self._setup, models.get(model), request, model)
        verdict = GateVerdict(self._gate.rejecting if len(request.readings) else "", counts, self._gate.reset_count)
        return RefitReply(fit if model is Model.NEW_FIT else None, prediction, notes, model, verdict)


def before_fit(setup: RefitSetup, now_tai_s: float) -> FitResult | None:
    """What the prediction is made from before the first reading; None: the elements alone.

    What an earlier pass left, aged to now, or the fit that this pass had before the daemon was started again.
    """
    carried, source = setup.carried, setup.propagator
    if carried is None or not (carried.is_of_this_pass or has_covariance(setup.estimator)):
        return None
    pedestal = None if setup.memory is None else prior_of(setup.memory, setup.settings, now_tai_s)
    fit = first_fit(carried, aged_prior(carried, source, setup.site, setup.settings, now_tai_s, pedestal))
    if not carried.is_of_this_pass:
        return fit
    along_s, across_deg = shift_for_people(source, fit.correction, fit.at_tai_s, setup.site)
    covariance = fit.covariance if has_covariance(setup.estimator) else None
    return replace(fit, along_s=along_s, across_deg=across_deg, covariance=covariance)


def predict_from(setup: RefitSetup, fit: FitResult | None, request: RefitRequest, model: Model) -> Prediction:
    """Make the buffer from the orbit that a fit found, or from the elements alone.  model: which of them it is.

    Raises: OrbitError: the propagator has no answer for the span.
    """
    prediction = predict(
        setup.propagator if fit is None else setup.propagator.corrected(fit.correction),
        setup.site,
        request.start_tai_s,
        made_at_tai_s=request.now_tai_s,
        kind=model.kind,
        horizon_s=request.horizon_s,
        step_s=setup.step_s,
        near_az_deg=request.near_az_deg,
        lead_in_s=longest_window_s(setup.azimuth),
        keyhole=replace(setup.keyhole, may_plunge=setup.may_plunge and request.may_plunge),
        in_hand=request.in_hand,
        zenith_turn=request.zenith_turn,
        fit=fit,
        is_plunged=request.is_plunged,
    )
    what = (setup.propagator, setup.site, setup.settings)
    spread = spread_of(*what, fit, prediction, request.now_tai_s)
    return replace(prediction, model=model, spread=spread)

"""What comes into the tick and is no number: left out before anything is decided from it.  Pure.

A status, a plan or a fit with one field that is not finite is left out whole; of a prediction only the instants are
that are not finite (`Pointing.is_finite`): the register limiter refuses them, and the last good register stays.
"""

from dataclasses import replace
from math import inf, isnan

from acu_daemon.control.tick_input import PassPlan, Sky, TickInput
from acu_daemon.model import MOST_DEG, FitResult, Prediction

MOST_S = 1e12  # 30 000 years: more is no time


def finite_only(given: TickInput) -> tuple[TickInput, str]:
    """What of a tick's input can be used, and the names of what cannot."""
    seen, sky = given.seen, given.sky
    refused: list[str] = []
    status, reading = seen.status, seen.reading
    if (status is not None and not _are_angles(status.az_deg, status.el_deg)) or (
        reading is not None and not (abs(reading.tai_s) <= MOST_S and _are_angles(reading.az_deg, reading.el_deg))
    ):
        refused.append("status")
        seen = replace(seen, status=None, reading=None)
    if isnan(seen.silence_s):
        seen = replace(seen, silence_s=inf)
    prediction, fit, plan = sky.prediction, sky.fit, sky.plan
    if prediction is not None and not _is_prediction(prediction):
        refused.append("prediction")
        prediction = None
    if fit is not None and not is_fit(fit):
        refused.append("fit")
        fit = None
    if plan is not None and not is_plan(plan):
        refused.append("plan")
        plan = None
    if not refused and seen is given.seen:
        return given, ""
    return replace(given, seen=seen, sky=Sky(prediction, fit, plan)), ", ".join(refused)


def _is_prediction(prediction: Prediction) -> bool:
    return abs(prediction.start_tai_s) <= MOST_S and abs(prediction.end_tai_s) <= MOST_S and prediction.step_s > 0.0


def is_fit(fit: FitResult) -> bool:
    """Whether what the decision reads of a fit is finite."""
    return abs(fit.along_s) <= MOST_S and abs(fit.at_tai_s) <= MOST_S and abs(fit.across_deg) <= MOST_DEG


def is_plan(plan: PassPlan) -> bool:
    """Whether a plan is finite."""
    are_times = abs(plan.rise_tai_s) <= MOST_S and abs(plan.set_tai_s) <= MOST_S and abs(plan.start_tai_s) <= MOST_S
    return are_times and _are_angles(plan.start_az_deg, plan.start_el_deg)


def _are_angles(az_deg: float, el_deg: float) -> bool:
    return abs(az_deg) <= MOST_DEG and abs(el_deg) <= MOST_DEG

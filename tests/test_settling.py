"""The first seconds after the first fit and after a loss, on a fast real pass in virtual time."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import pytest
from conftest import needs_data
from flights import changed, loss, register_errors_deg, sky_of, worst_error_deg
from script_modules import load

from acu_daemon.cli.options import load_target
from acu_daemon.cli.virtual_pass import Flight, fly
from acu_daemon.control.tracking.lag import PRIOR_LAG_S
from acu_daemon.edge.fit import InlineFitRunner
from acu_daemon.sim.scenario import Scenario, read_scenario

pass_rig = load("pass_rig")
pytestmark = [needs_data, pytest.mark.long]
BYTE_TIME_S = 10 / 9600
MAX_ERROR_DEG = 0.1
TRACKED_S = 16.0  # before the loss of the scenario
ESTIMATORS = ("circular", "deterministic", "kalman", "full")
LATENCIES_S = (0.5, 2.0, 3.0)  # of a fit process that is only starting, on a busy machine


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A minute in the middle of the pass, where the satellite moves at 1 deg/s; the loss begins after 40 %."""
    return pass_rig.make_scene(tmp_path_factory.mktemp("scene"), pass_rig.DEFAULT_PASS, 60.0)


@pytest.fixture(scope="module")
def scenario(scene: Any) -> Scenario:
    return read_scenario(scene.config / "scenario.toml")


def flight_until(end_tai_s: float, scene: Any, scenario: Scenario, estimator: str = "full", **parts: Any) -> Flight:
    target = load_target(scene.config, scene.satellite, scene.start_tai_s)
    target = changed(target, tracking={"estimator": estimator})
    return fly(target, scene.truth, scenario, begin_tai_s=scene.start_tai_s, end_tai_s=end_tai_s, **parts)


def first_fit_tai_s(flight: Flight) -> float:
    return next(seen.tai_s for seen in flight.snapshots if seen.state == "AUTOTRACK/FITTED")


def late_by(latency_s: float) -> Callable[..., InlineFitRunner]:
    return partial(InlineFitRunner, latency_s=latency_s)


@pytest.mark.parametrize("latency_s", LATENCIES_S)
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_first_fit_takes_the_registers_no_further_off_however_late_it_comes(
    scene: Any, scenario: Scenario, estimator: str, latency_s: float
) -> None:
    end_tai_s = scene.start_tai_s + TRACKED_S
    flight = flight_until(end_tai_s, scene, scenario, estimator, make_runner=late_by(latency_s))
    sky = sky_of(load_target(scene.config, scene.satellite, scene.start_tai_s), truth=scene.truth)
    errors_deg = register_errors_deg(flight, sky, first_fit_tai_s(flight), end_tai_s - 1.0)
    assert len(errors_deg) > 10
    assert max(errors_deg) <= MAX_ERROR_DEG


@pytest.mark.parametrize("latency_s", LATENCIES_S)
def test_a_loss_right_after_a_late_first_fit_is_held(scene: Any, scenario: Scenario, latency_s: float) -> None:
    late = late_by(latency_s)
    fit_tai_s = first_fit_tai_s(flight_until(scene.start_tai_s + TRACKED_S, scene, scenario, make_runner=late))
    lost = replace(scenario, losses=(loss(fit_tai_s + 0.3, fit_tai_s + 9.0),))
    flight = flight_until(fit_tai_s + 5.3, scene, lost, make_runner=late)
    assert worst_error_deg(flight, fit_tai_s + 0.3, fit_tai_s + 5.0) <= MAX_ERROR_DEG


def test_a_servo_that_takes_up_a_fast_path_is_not_taken_for_a_slow_one(scene: Any, scenario: Scenario) -> None:
    (lost_at_tai_s, _), *_ = (loss.window_tai_s(scene.start_tai_s) for loss in scenario.losses)
    flight = flight_until(lost_at_tai_s + 4.0, scene, scenario, byte_time_s=BYTE_TIME_S)
    lags_s = {seen.lag_az_s for seen in flight.snapshots if 0.0 < seen.tai_s - lost_at_tai_s < 1.0}
    assert lags_s == {PRIOR_LAG_S}
    errors_deg = [row.beam_error_deg for row in flight.rows if 0.0 < row.tai_s - lost_at_tai_s < 3.0]
    assert max(error for error in errors_deg if error is not None) <= MAX_ERROR_DEG

"""The first second after a loss, on a fast real pass over a 9600 baud line in virtual time."""

from pathlib import Path

from conftest import needs_data
from script_modules import load

from acu_daemon.cli.options import load_target
from acu_daemon.cli.virtual_pass import fly
from acu_daemon.control.lag import PRIOR_LAG_S
from acu_daemon.sim.scenario import read_scenario

pass_rig = load("pass_rig")
BYTE_TIME_S = 10 / 9600
MAX_ERROR_DEG = 0.1


@needs_data
def test_a_servo_that_takes_up_a_fast_path_is_not_taken_for_a_slow_one(tmp_path: Path) -> None:
    scene = pass_rig.make_scene(tmp_path, pass_rig.DEFAULT_PASS, 60.0)
    scenario = read_scenario(scene.config / "scenario.toml")
    (lost_at_tai_s, _), *_ = (loss.window_tai_s(scene.start_tai_s) for loss in scenario.losses)
    flight = fly(
        load_target(scene.config, scene.satellite, scene.start_tai_s),
        scene.truth,
        scenario,
        begin_tai_s=scene.start_tai_s,
        end_tai_s=lost_at_tai_s + 4.0,
        byte_time_s=BYTE_TIME_S,
    )
    lags_s = {seen.lag_az_s for seen in flight.snapshots if 0.0 < seen.tai_s - lost_at_tai_s < 1.0}
    assert lags_s == {PRIOR_LAG_S}
    errors_deg = [row.beam_error_deg for row in flight.rows if 0.0 < row.tai_s - lost_at_tai_s < 3.0]
    assert max(error for error in errors_deg if error is not None) <= MAX_ERROR_DEG

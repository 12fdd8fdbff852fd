"""Whether autotrack holds something else than this pass's satellite: a side lobe, another satellite, the sun.  Pure.

Judged against a fit that is worth it: many readings, and 3 sigma of its prediction within a quarter of the beam.  The
screening keeps the readings of a false lock from the fit, so the prediction stays on the satellite meanwhile.  What is
farther from it than FALSE_SIGMAS of the prediction, and than FALSE_BEAMS, without a break for false_lock_s, is not the
satellite.  Near the zenith, where autotrack itself lags, nothing is judged.

Owner of `FalseLock`.
"""

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, FalseLock
from acu_daemon.control.tick_input import Sky, TickInput
from acu_daemon.control.tracking.causes import is_acquired
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Pointing, Reading, sky_angle_deg

FALSE_SIGMAS, FALSE_BEAMS = 6.0, 0.6
MATURE_COUNT, MATURE_BEAMS = 150, 0.25
CALM_SHARE = 0.5  # of the drive's rate: faster paths are lagged behind
MOST_LEFT = 5  # of a pass: what is left again and again is not left for the better


def watch_lock(state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]) -> ControlState:
    """Look at the newest reading; a lock that turns out false is counted and told."""
    lock, reading, status = state.false_lock, given.seen.reading, given.seen.status
    if not config.leave_false_lock or reading is None or status is None or not given.seen.is_in_step:
        return state
    off_deg = None
    if state.tracking.track is TrackState.AUTOTRACK_FITTED and is_acquired(status):
        off_deg = _off_deg(reading, given.sky, config)
    if off_deg is None:
        return state if lock.since_tai_s is None else with_parts(state, false_lock=FalseLock(None, lock.count))
    since_tai_s = reading.tai_s if lock.since_tai_s is None else lock.since_tai_s
    is_false = reading.tai_s - since_tai_s >= config.false_lock_s and lock.count < MOST_LEFT
    if is_false and not lock.is_false:
        fields = {"off_deg": round(off_deg, 2), "for_s": round(reading.tai_s - since_tai_s, 1), "count": lock.count + 1}
        events.append(Event("lock.false", fields, is_warning=True))
    count = lock.count + (is_false and not lock.is_false)
    return with_parts(state, false_lock=FalseLock(since_tai_s, count, is_false or lock.is_false))


def _off_deg(reading: Reading, sky: Sky, config: ControlConfig) -> float | None:
    """How far a reading is off the fit's path, where that says that it is not the satellite's; None: it may be."""
    prediction, fit = sky.prediction, sky.fit
    if prediction is None or fit is None or not sky.is_fitted or fit.reading_count < MATURE_COUNT:
        return None
    inside_s = prediction.seconds_inside(reading.tai_s, MATURE_BEAMS * config.beamwidth_deg)
    point = prediction.at(reading.tai_s)
    if not inside_s or point is None or not _is_calm(point, config):
        return None
    k = round((reading.tai_s - prediction.start_tai_s) / prediction.step_s)
    sigma_deg = (
        0.0 if prediction.sigma_deg is None else float(prediction.sigma_deg[min(k, prediction.sigma_deg.size - 1)])
    )
    off_deg = sky_angle_deg(reading.az_deg, reading.el_deg, point.az_deg, point.el_deg)
    return off_deg if off_deg > max(FALSE_SIGMAS * sigma_deg, FALSE_BEAMS * config.beamwidth_deg) else None


def _is_calm(point: Pointing, config: ControlConfig) -> bool:
    return (
        point.is_finite
        and abs(point.az_rate_deg_s) < CALM_SHARE * config.azimuth.max_rate_deg_s
        and abs(point.el_rate_deg_s) < CALM_SHARE * config.elevation.max_rate_deg_s
    )

"""Made passes of a satellite like KOMPSAT-3 over Daejeon, by a numpy generator: six kinds of missions.

Orbit: a = 7063.14 km, e = 0.001, i = 98.127 deg, local time of the ascending node 13:30, by SGP4.  Missions: nadir,
a strip, a stereo pair, three to five points, a target within 200 km of the station, a strip before a playback on nadir.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi

import numpy as np

from acu_daemon.model import AxisLimits, Pass, Site, Station
from acu_daemon.onboard.attitude import Agility, AttitudePlan, Hold, plan_attitude
from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.missions import angles_to, with_nadir
from acu_daemon.onboard.profile import Task, within
from acu_daemon.onboard.view import ground_points_itrs_m, view_pass
from acu_daemon.orbit.element_set import SGP4_MU_M3_S2, ElementSet
from acu_daemon.orbit.frames import station_itrs_m, teme_from_itrs
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S, DEG

DAEJEON = Station("Daejeon", 36.37, 127.36, 80.0)
KINDS = ("nadir", "strip", "stereo", "multi-point", "domestic", "strip+playback")
MIN_ELEVATION_DEG = 5.0
AZIMUTH = AxisLimits(-270.0, 270.0, inf, inf)
ELEVATION = AxisLimits(0.0, 110.0, inf, inf)

_EPOCH_TAI_S = tai_from_utc("2015-03-20T22:45:00Z")  # the equinox: the mean Sun's right ascension is 0
_SUN_RAD_S = 2.0 * pi / (365.2422 * DAY_S)
_LTAN_H = 13.5
_A_M, _E, _I_DEG = 7063.14e3, 0.001, 98.127
_BSTAR = 2e-5
_LEAST_CULMINATION_DEG = {"domestic": 50.0}
_CULMINATION_DEG = 15.0
_NEAR_M = 200e3
_MOST_TRIES = 400
_STEEPEST_DEG = 30.0
_HEIGHT_KM, _GROUND_SPEED_KM_S = 690.0, 6.85


@dataclass(frozen=True, slots=True)
class OnboardScenario:
    """A pass, an orbit and an attitude."""

    kind: str
    propagator: Sgp4Propagator
    attitude: AttitudePlan
    site: Site
    seen: Pass


def make_scenario(kind: str, rng: np.random.Generator) -> OnboardScenario:
    """Draw a date, a place in the orbit, a pass that culminates high enough, and a mission of that kind."""
    site = Site(DAEJEON)
    for _ in range(_MOST_TRIES):
        start_tai_s = _EPOCH_TAI_S + float(rng.uniform(0.0, 365.0)) * DAY_S
        propagator = Sgp4Propagator(_elements(start_tai_s, float(rng.uniform(0.0, 2.0 * pi))))
        least_deg = _LEAST_CULMINATION_DEG.get(kind, _CULMINATION_DEG)
        passes = find_passes(propagator, site, start_tai_s, start_tai_s + DAY_S, MIN_ELEVATION_DEG)
        high = [one for one in passes if one.culmination_el_deg >= least_deg]
        if not high:
            continue
        seen = high[int(rng.integers(len(high)))]
        holds = _MISSIONS[kind](propagator, seen, rng)
        if holds is not None:
            return OnboardScenario(kind, propagator, plan_attitude(holds, Agility()), site, seen)
    raise ValueError(f"no pass for the kind {kind!r} in {_MOST_TRIES} draws")


def _elements(epoch_tai_s: float, mean_anomaly_rad: float) -> ElementSet:
    sun_rad = _SUN_RAD_S * (epoch_tai_s - _EPOCH_TAI_S)
    return ElementSet(
        kind="tle",
        name="KOMPSAT-3 alike",
        norad_id=38338,
        epoch_tai_s=epoch_tai_s,
        mean_motion_rad_s=(SGP4_MU_M3_S2 / _A_M**3) ** 0.5,
        eccentricity=_E,
        inclination_rad=_I_DEG * DEG,
        raan_rad=(sun_rad + (_LTAN_H - 12.0) * 15.0 * DEG) % (2.0 * pi),
        argp_rad=pi / 2.0,
        mean_anomaly_rad=mean_anomaly_rad,
        bstar_per_radius=_BSTAR,
        file="made",
    )


_Holds = list[Hold] | None


def _nadir(_propagator: Sgp4Propagator, seen: Pass, _rng: np.random.Generator) -> _Holds:
    return [Hold(seen.rise_tai_s, seen.set_tai_s)]


def _steep(rng: np.random.Generator) -> float:
    return float(rng.uniform(-_STEEPEST_DEG, _STEEPEST_DEG))


def _strip(_propagator: Sgp4Propagator, seen: Pass, rng: np.random.Generator) -> _Holds:
    length_s = float(rng.uniform(10.0, 60.0))
    start = seen.rise_tai_s + float(rng.uniform(0.15, 0.85)) * (seen.duration_s - length_s)
    return _imaging([(start, length_s, _steep(rng), 0.0)], seen)


def _stereo(_propagator: Sgp4Propagator, seen: Pass, rng: np.random.Generator) -> _Holds:
    """The same ground twice: pitched forward, then back, at the time that its place under the orbit asks for."""
    length_s, pitch_deg = float(rng.uniform(8.0, 20.0)), float(rng.uniform(20.0, _STEEPEST_DEG))
    roll_deg = float(rng.uniform(-15.0, 15.0))
    turn_s = Agility().slew_s(2.0 * pitch_deg) + Agility().settle_s + length_s + 0.1
    apart_s = max(2.0 * pitch_deg * DEG * _HEIGHT_KM / _GROUND_SPEED_KM_S, turn_s)
    start = seen.rise_tai_s + float(rng.uniform(0.2, 0.8)) * (seen.duration_s - apart_s - length_s)
    return _imaging([(start, length_s, roll_deg, pitch_deg), (start + apart_s, length_s, roll_deg, -pitch_deg)], seen)


def _multi_point(_propagator: Sgp4Propagator, seen: Pass, rng: np.random.Generator) -> _Holds:
    shots = []
    at = seen.rise_tai_s + float(rng.uniform(0.1, 0.3)) * seen.duration_s
    before = (0.0, 0.0)
    for _ in range(int(rng.integers(3, 6))):
        angles = _steep(rng), float(rng.uniform(-20.0, 20.0))
        turn_deg = max(abs(a - b) for a, b in zip(angles, before, strict=True))
        at += Agility().slew_s(turn_deg) + Agility().settle_s + 0.1
        length_s = float(rng.uniform(6.0, 12.0))
        shots.append((at, length_s, *angles))
        at, before = at + length_s, angles
    return _imaging(shots, seen)


def _domestic(propagator: Sgp4Propagator, seen: Pass, rng: np.random.Generator) -> _Holds:
    """A target near the station, imaged when it is abeam or up to 20 s off."""
    bearing, distance = rng.uniform(0.0, 360.0), _NEAR_M * rng.uniform(0.0, 1.0) ** 0.5
    target = ground_points_itrs_m(DAEJEON, np.array([bearing]), np.array([distance]))[0]
    length_s = float(rng.uniform(8.0, 20.0))
    times = np.linspace(seen.rise_tai_s, seen.set_tai_s, 600)
    r_m, _ = propagator.states_teme(times)
    ranges = np.linalg.norm(teme_from_itrs(target, times, Site(DAEJEON).orientation) - r_m, axis=1)
    middle = float(times[int(np.argmin(ranges))]) + float(rng.uniform(-20.0, 20.0))
    roll_deg, pitch_deg = angles_to(propagator, target, middle, Site(DAEJEON).orientation)
    if max(abs(roll_deg), abs(pitch_deg)) > _STEEPEST_DEG:
        return None
    return _imaging([(middle - length_s / 2.0, length_s, roll_deg, pitch_deg)], seen)


def _strip_playback(propagator: Sgp4Propagator, seen: Pass, rng: np.random.Generator) -> _Holds:
    length_s = float(rng.uniform(10.0, 40.0))
    start = seen.rise_tai_s + float(rng.uniform(0.05, 0.2)) * seen.duration_s
    return _imaging([(start, length_s, _steep(rng), 0.0)], seen)


def _imaging(shots: list[tuple[float, float, float, float]], seen: Pass) -> _Holds:
    """Holds of the shots (start, length, roll, pitch) with nadir around; None where they do not fit into the pass."""
    if shots[-1][0] + shots[-1][1] > seen.set_tai_s:
        return None
    holds = [Hold(start, start + length_s, roll, pitch, 0.0, True) for start, length_s, roll, pitch in shots]
    return with_nadir(holds, Agility(), seen.rise_tai_s, seen.set_tai_s)


_MISSIONS: dict[str, Callable[[Sgp4Propagator, Pass, np.random.Generator], _Holds]] = {
    "nadir": _nadir,
    "strip": _strip,
    "stereo": _stereo,
    "multi-point": _multi_point,
    "domestic": _domestic,
    "strip+playback": _strip_playback,
}


def scenario_task(scenario: OnboardScenario, cone: Cone, azimuth: AxisLimits | None = None) -> Task:
    """What the scenario's pass asks of an aligned antenna; azimuth's limits default to its range alone."""
    seen, site = scenario.seen, scenario.site
    view = view_pass(
        scenario.propagator, scenario.attitude, np.eye(3), site.orientation, seen.rise_tai_s, seen.set_tai_s
    )
    return Task(
        view=view,
        station_itrs_m=station_itrs_m(site.station),
        cone=cone,
        azimuth=azimuth or AZIMUTH,
        elevation=ELEVATION,
        imaging=within(view.tai_s, scenario.attitude.imaging_tai_s),
    )

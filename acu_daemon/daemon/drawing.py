"""What is drawn around the figures of a snapshot: where everything stands in the sky, and what stands around it.

Directions are azimuth and elevation in degrees, encoder frame.  Aim is taken with every snapshot,
PathAhead once a second, Backdrop once a pass.
"""

from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, radians

import numpy as np

from acu_daemon.assist.session.refit import RefitSetup
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.causes import path_point
from acu_daemon.control.tracking.scan import row_deg
from acu_daemon.control.tracking.track_frame import beside
from acu_daemon.daemon.area import CommonArea
from acu_daemon.edge.clock import Clock
from acu_daemon.errors import OrbitError
from acu_daemon.model import Pass, Prediction
from acu_daemon.orbit.look import apparent_at
from acu_daemon.units import wrap_180

Direction = tuple[float, float]
TRACK_COUNT = 90  # points of a whole pass
OWN_DEG = 1.5  # the elements' highest elevation is that of the pass
AHEAD_S = 2.0  # from point to point of the prediction
SIGMAS = 3.0
SKYLINE_STEP_DEG = 5.0
ROW_COUNT, ROW_POINTS = 9, 9  # of the search, as it is drawn


@dataclass(frozen=True, slots=True)
class Aim:
    """Where antenna and satellite stand now.  None: not known."""

    az_turn_deg: float | None = None  # measured azimuth, over all turns of the cable
    path_deg: Direction | None = None  # where the prediction has the satellite now
    beside_deg: Direction | None = None  # measured against the path at the reading's time: right, up, on the sky
    command_beside_deg: Direction | None = None  # the last command against the path for its time: right, up
    heading_deg: float | None = None  # of the satellite's motion on the sky: 0 up, 90 right
    spread_deg: Direction | None = None  # 3 sigma along and across, on the sky
    sun_deg: Direction | None = None
    written_age_s: float | None = None  # since the last command took effect


@dataclass(frozen=True, slots=True)
class Backdrop:
    """What stands around them.  Points are rounded: they are drawn, and not computed with."""

    azimuth_deg: Direction  # soft limits
    elevation_deg: Direction
    lowest_deg: float
    beamwidth_deg: float
    has_signal: bool
    skyline: tuple[Direction, ...] = ()
    keep_outs: tuple[tuple[str, float, float, float, float], ...] = ()  # name, azimuth from, to, elevation from, to
    sun_radius_deg: float | None = None  # where the beam keeps out of it
    rise_tai_s: float | None = None
    culmination_tai_s: float | None = None
    set_tai_s: float | None = None
    hidden_tai_s: tuple[tuple[float, float], ...] = ()
    track: tuple[tuple[float, float, float], ...] = ()  # the whole pass by its elements: TAI, azimuth, elevation
    keyhole_el_deg: float | None = None  # above it the azimuth drive cannot follow this pass


@dataclass(frozen=True, slots=True)
class PathAhead:
    """What the newest prediction says, and what a search has covered of it."""

    crossing_tai_s: tuple[float, float] | None = None  # the antenna's own way past the zenith
    ahead: tuple[Direction, ...] = ()  # the prediction from now on
    searched: tuple[tuple[Direction, ...], ...] = ()  # rows as covered: right and up of where the satellite is now


def take_aim(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig) -> Aim:
    """Where everything stands now."""
    status, reading, sun = state.intake.status, state.intake.reading, config.envelope.sun
    point = path_point(sky, now_tai_s, follow=False)
    seen_on = path_point(sky, reading.tai_s, follow=False) if reading is not None else None
    written = state.registers.in_force
    led_on = path_point(sky, written[0] + config.effect_delay_s, follow=False) if written is not None else None
    beside_deg = None
    if reading is not None and seen_on is not None:
        beside_deg = _offset_deg((reading.az_deg, reading.el_deg), (seen_on.az_deg, seen_on.el_deg))
    command_deg = None
    if written is not None and led_on is not None:
        command_deg = _offset_deg((written[1], written[2]), (led_on.az_deg, led_on.el_deg))
    heading_deg = speed_deg_s = None
    if point is not None:
        right, up = point.az_rate_deg_s * cos(radians(point.el_deg)), point.el_rate_deg_s
        heading_deg, speed_deg_s = degrees(atan2(right, up)), hypot(right, up)
    return Aim(
        az_turn_deg=state.intake.az_deg if status is not None else None,
        path_deg=(point.az_deg, point.el_deg) if point is not None else None,
        beside_deg=beside_deg,
        command_beside_deg=command_deg,
        heading_deg=heading_deg,
        spread_deg=_spread_deg(sky.prediction, now_tai_s, speed_deg_s),
        sun_deg=sun.direction_deg(now_tai_s) if sun is not None else None,
        written_age_s=now_tai_s - written[0] if written is not None else None,
    )


def _offset_deg(here: Direction, there: Direction) -> Direction:
    return wrap_180(here[0] - there[0]) * cos(radians(there[1])), here[1] - there[1]


def _spread_deg(prediction: Prediction | None, now_tai_s: float, speed_deg_s: float | None) -> Direction | None:
    """3 sigma along and across; where only one sigma is known, of both."""
    if prediction is None or speed_deg_s is None:
        return None
    if prediction.spread is not None:
        return SIGMAS * prediction.spread[0] * speed_deg_s, SIGMAS * prediction.spread[1]
    if prediction.sigma_deg is None:
        return None
    i = round((now_tai_s - prediction.start_tai_s) / prediction.step_s)
    sigma_deg = SIGMAS * float(prediction.sigma_deg[min(max(i, 0), prediction.sigma_deg.size - 1)])
    return sigma_deg, sigma_deg


def take_track(setup: RefitSetup, coming: Pass | None) -> tuple[tuple[float, float, float], ...]:
    """The whole pass by its elements, TAI, azimuth and elevation; nothing where they do not reach.

    Nor where they are another satellite's: a station at rest waits for one pass with the orbit of any satellite.
    """
    if coming is None:
        return ()
    times = np.linspace(coming.rise_tai_s, coming.set_tai_s, TRACK_COUNT)
    try:
        seen = apparent_at(setup.propagator, times, setup.site)
    except OrbitError:
        return ()
    if abs(float(np.max(seen.el_deg)) - coming.culmination_el_deg) > OWN_DEG:
        return ()
    rounded = zip(times.tolist(), np.round(seen.az_deg, 2).tolist(), np.round(seen.el_deg, 2).tolist(), strict=True)
    return tuple(rounded)


def take_backdrop(
    config: ControlConfig, coming: Pass | None, track: tuple[tuple[float, float, float], ...]
) -> Backdrop:
    """What stands around antenna and satellite in this pass."""
    envelope = config.envelope
    azimuth, elevation, sun = envelope.azimuth, envelope.elevation, envelope.sun
    return Backdrop(
        azimuth_deg=(azimuth.min_deg, azimuth.max_deg),
        elevation_deg=(elevation.min_deg, elevation.max_deg),
        lowest_deg=config.min_elevation_deg,
        beamwidth_deg=config.beamwidth_deg,
        has_signal=config.has_signal,
        skyline=_skyline(config),
        keep_outs=tuple(
            (one.name, one.az_from_deg, one.az_to_deg, one.el_from_deg, one.el_to_deg) for one in envelope.keep_outs
        ),
        sun_radius_deg=sun.radius_deg if sun is not None and sun.policy == "avoid" else None,
        rise_tai_s=coming.rise_tai_s if coming else None,
        culmination_tai_s=coming.culmination_tai_s if coming else None,
        set_tai_s=coming.set_tai_s if coming else None,
        hidden_tai_s=coming.hidden_tai_s if coming else (),
        track=track,
        keyhole_el_deg=_keyhole_el_deg(track, azimuth.max_rate_deg_s),
    )


def take_ahead(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig) -> PathAhead:
    """What is predicted and what was searched, as it stands now."""
    prediction = sky.prediction
    crossing = prediction.crossing if prediction is not None else None
    crossing = crossing or (sky.plan.crossing if sky.plan is not None else None)
    return PathAhead(
        crossing_tai_s=(crossing.departure_tai_s, crossing.return_tai_s) if crossing is not None else None,
        ahead=_ahead(prediction, now_tai_s),
        searched=_searched(state, prediction, now_tai_s, config),
    )


def _skyline(config: ControlConfig) -> tuple[Direction, ...]:
    skyline = config.envelope.skyline
    if skyline is None:
        return ()
    azimuths = np.arange(0.0, 360.0, SKYLINE_STEP_DEG)
    return tuple(zip(azimuths.tolist(), np.round(skyline.heights_deg(azimuths), 1).tolist(), strict=True))


def _keyhole_el_deg(track: tuple[tuple[float, float, float], ...], max_rate_deg_s: float) -> float | None:
    """Above which elevation azimuth = speed / cos(elevation) exceeds the drive, at the greatest speed of the pass."""
    if len(track) < 2:
        return None
    tai_s, az_deg, el_deg = np.array(track).T
    right = np.diff(np.unwrap(np.radians(az_deg))) * np.cos(np.radians((el_deg[1:] + el_deg[:-1]) / 2.0))
    speed_deg_s = float(np.max(np.hypot(np.degrees(right), np.diff(el_deg)) / np.diff(tai_s)))
    return round(degrees(np.arccos(min(1.0, speed_deg_s / max_rate_deg_s))), 1)


def _ahead(prediction: Prediction | None, now_tai_s: float) -> tuple[Direction, ...]:
    if prediction is None:
        return ()
    first = max(0, round((now_tai_s - prediction.start_tai_s) / prediction.step_s))
    part = slice(first, None, max(1, round(AHEAD_S / prediction.step_s)))
    az_deg, el_deg = np.round(prediction.az_deg[part], 2), np.round(prediction.el_deg[part], 2)
    return tuple(zip(az_deg.tolist(), el_deg.tolist(), strict=True))


def _searched(
    state: ControlState, prediction: Prediction | None, now_tai_s: float, config: ControlConfig
) -> tuple[tuple[Direction, ...], ...]:
    """The rows that a search has covered, as lines beside where the satellite is now."""
    rows, here = state.search.scan.rows, prediction.at(now_tai_s) if prediction is not None else None
    if prediction is None or here is None or not rows:
        return ()
    lines = []
    for row, (early_s, late_s) in sorted(rows, key=lambda one: abs(one[0]))[:ROW_COUNT]:
        places = [
            beside(prediction, now_tai_s, (float(along_s), row * row_deg(config)))
            for along_s in np.linspace(early_s, late_s, ROW_POINTS)
        ]
        lines.append(tuple(_offset_deg((one.az_deg, one.el_deg), (here.az_deg, here.el_deg)) for one in places if one))
    return tuple(line for line in lines if line)


class DrawingBoard:
    """Draws one run for whoever looks.  Owned by its service; the track is reckoned when it is asked for first."""

    def __init__(
        self, area: CommonArea, config: ControlConfig, setup: RefitSetup, coming: Pass | None, clock: Clock
    ) -> None:
        self._area, self._config, self._setup, self._coming, self._clock = area, config, setup, coming, clock
        self._backdrop: Backdrop | None = None

    def aim(self) -> Aim:
        """Where everything stands now."""
        return take_aim(self._area.state, self._area.sky, self._clock.tai_s(), self._config)

    def path_ahead(self) -> PathAhead:
        """What is predicted and searched, now."""
        return take_ahead(self._area.state, self._area.sky, self._clock.tai_s(), self._config)

    def backdrop(self) -> Backdrop:
        """What stands around, the same object all through a run."""
        if self._backdrop is None:
            self._backdrop = take_backdrop(self._config, self._coming, take_track(self._setup, self._coming))
        return self._backdrop

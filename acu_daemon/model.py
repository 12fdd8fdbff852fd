"""The frozen values that cross rooms.  Everything here is data; the rooms give it meaning.

Time is TAI seconds since 2000-01-01T12:00:00 TAI, one float (0.1 us today), monotone through leap seconds.
Angles are degrees.  Azimuth is clockwise from true north.  "Encoder frame" means as the ACU counts it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import asin, cos, degrees, radians, sin, sqrt
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from acu_daemon.units import Array


@dataclass(frozen=True, slots=True)
class Station:
    """Where the antenna stands: geodetic, WGS84, east positive."""

    name: str
    latitude_deg: float
    longitude_deg: float
    height_m: float


@dataclass(frozen=True, slots=True)
class EarthOrientation:
    """What turns a quasi-inertial frame into the Earth-fixed one beyond sidereal time."""

    ut1_utc_s: float = 0.0
    polar_x_arcsec: float = 0.0
    polar_y_arcsec: float = 0.0


class Antenna(Protocol):
    """Air and mount, between geometric directions and what the encoders read: pointing.antenna_model.

    Angles in degrees, () or (N,), azimuths continuous; range_m: the satellite's distance.
    """

    def geometric_deg(
        self, encoder_az_deg: npt.ArrayLike, encoder_el_deg: npt.ArrayLike, range_m: npt.ArrayLike
    ) -> tuple[Array, Array]: ...

    def with_rates(
        self, az_deg: Array, el_deg: Array, range_m: Array, az_rate_deg_s: Array, el_rate_deg_s: Array
    ) -> tuple[Array, Array, Array, Array]: ...

    def with_rates_plunged(
        self, az_deg: Array, el_deg: Array, range_m: Array, az_rate_deg_s: Array, el_rate_deg_s: Array
    ) -> tuple[Array, Array, Array, Array]: ...

    def apparent_el_deg(self, el_deg: npt.ArrayLike, range_m: npt.ArrayLike) -> Array: ...

    @property
    def has_air(self) -> bool: ...

    @property
    def frame(self) -> str: ...

    def refraction_shape(self, el_deg: Array, range_m: npt.ArrayLike) -> tuple[Array, Array]: ...


class Horizon(Protocol):
    """What stands around a station, above which the sky is seen: pointing.skyline.  Degrees, (N,)."""

    def heights_deg(self, az_deg: Array) -> Array: ...


@dataclass(frozen=True, slots=True)
class Site:
    """A station together with the Earth orientation in force, and its antenna; None: a perfect one in a vacuum.

    has_light_time: whether look angles are of where the signal comes from, range / c late (orbit.look).
    """

    station: Station
    orientation: EarthOrientation = EarthOrientation()
    has_light_time: bool = False
    antenna: Antenna | None = None
    skyline: Horizon | None = None  # None: a level one, the lowest elevation


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """Soft limits and drive limits of one axis."""

    min_deg: float
    max_deg: float
    max_rate_deg_s: float
    max_acceleration_deg_s2: float


@dataclass(frozen=True, slots=True)
class Reading:
    """One time-tagged azimuth/elevation pair from the ACU: encoder angles, azimuth in [0, 360)."""

    tai_s: float
    az_deg: float
    el_deg: float
    is_locked: bool  # the raw acquisition flag; the dwell is applied by whoever fits
    agc_db: float | None = None  # None: unknown, such as in a recording


@dataclass(frozen=True, slots=True)
class Readings:
    """Readings to fit, oldest first; every array is (N,)."""

    tai_s: Array
    az_deg: Array
    el_deg: Array
    agc_db: Array | None = None  # NaN where one is unknown; None: all are
    was_plunged: npt.NDArray[np.bool_] | None = None  # where the angles are the sky's: taken beyond the zenith

    def __len__(self) -> int:
        return int(self.tai_s.size)

    def part(self, which: slice | npt.NDArray[np.bool_] | npt.NDArray[np.int64]) -> "Readings":
        """The readings that an index of arrays picks."""
        agc_db = None if self.agc_db is None else self.agc_db[which]
        was_plunged = None if self.was_plunged is None else self.was_plunged[which]
        return Readings(self.tai_s[which], self.az_deg[which], self.el_deg[which], agc_db, was_plunged)

    def tail(self, newest_s: float) -> "Readings":
        """The newest ones, over so many seconds."""
        return self.part(self.tai_s >= self.tai_s[-1] - newest_s - 1e-6)

    @property
    def span_s(self) -> float:
        """From the first to the last one; 0 without any."""
        return float(self.tai_s[-1] - self.tai_s[0]) if len(self) else 0.0

    @property
    def second_count(self) -> int:
        """Seconds in which there is a reading."""
        return int(np.unique(np.floor(self.tai_s)).size)

    @staticmethod
    def of(readings: Iterable[Reading]) -> "Readings":
        """Single readings as arrays."""
        rows = [(r.tai_s, r.az_deg, r.el_deg, np.nan if r.agc_db is None else r.agc_db) for r in readings]
        tai_s, az_deg, el_deg, agc_db = np.array(rows, dtype=np.float64).reshape(-1, 4).T
        return Readings(tai_s, az_deg, el_deg, None if bool(np.all(np.isnan(agc_db))) else agc_db)

    @staticmethod
    def joined(parts: Sequence["Readings"]) -> "Readings":
        """One after the other."""
        if len(parts) == 1:
            return parts[0]
        tai_s, az_deg, el_deg = (
            np.concatenate([getattr(one, name) for one in parts]) for name in ("tai_s", "az_deg", "el_deg")
        )
        agc_db = [np.full(len(one), np.nan) if one.agc_db is None else one.agc_db for one in parts]
        return Readings(
            tai_s, az_deg, el_deg, None if all(one.agc_db is None for one in parts) else np.concatenate(agc_db)
        )


@dataclass(frozen=True, slots=True)
class Correction:
    """What a fit adds to the mean elements of the source at its epoch.

    The eccentricity vector is (e cos argp, e sin argp).  A change of it turns the perigee and turns the mean anomaly
    back by as much, so delta_mean_anomaly_rad is what the sum argp + mean anomaly gains: well defined on a circle too.
    """

    delta_raan_rad: float = 0.0
    delta_mean_anomaly_rad: float = 0.0
    delta_mean_motion_rad_s: float = 0.0
    delta_e_cos_argp: float = 0.0
    delta_e_sin_argp: float = 0.0
    delta_inclination_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class AngleBias:
    """What the encoders show beyond the geometric angles, degrees; el is the elevation.

    Azimuth shows az_deg + az_sec_deg / cos(el) more (the second is the same everywhere across the beam's path, like a
    collimation error), elevation el_deg + el_cot_deg cot(el) (the second is shaped like refraction; where the site's
    antenna has air, like that air's, by its value at 45 deg: what the refraction is off the one told).  The others are
    the mount's terms beyond those surveyed (docs/antenna-model.md, Mount).
    """

    az_deg: float = 0.0
    az_sec_deg: float = 0.0
    el_deg: float = 0.0
    el_cot_deg: float = 0.0
    npae_deg: float = 0.0
    an_deg: float = 0.0
    aw_deg: float = 0.0
    tf_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class FitResult:
    """One accepted fit."""

    estimator: str
    correction: Correction
    at_tai_s: float  # time of the newest reading used
    reading_count: int
    rejected_count: int
    residual_rms_deg: float  # angle on the sky, newest readings against the fit
    along_s: float  # the correction for people: early (-) or late (+) along the track
    across_deg: float  # and across it, seen from the station, right of the motion positive
    bias: AngleBias = AngleBias()
    station_shift_enu_m: tuple[float, float, float] = (0.0, 0.0, 0.0)  # the station's true place minus the given one
    covariance: Array | None = field(default=None, compare=False, repr=False)  # (17, 17), see full.estimated_states


def plunged_bias(bias: AngleBias) -> AngleBias:
    """The biases of a plunged antenna, as those of one that is not.

    What turns with the elevation axis over the zenith shows the other way round: zero point of the elevation,
    collimation, and the elevation axis that is not level.  What belongs to ground and air stays.
    """
    return replace(bias, el_deg=-bias.el_deg, az_sec_deg=-bias.az_sec_deg, npae_deg=-bias.npae_deg)


HALF_TURN_DEG = 90.0  # from one sample to the next the azimuth turns by less than this, but where it is plunged
MOST_DEG = 1e5  # more is no azimuth, however often the path goes round, and no rate
PredictionKind = Literal["FITTED", "TLE"]


class Model(StrEnum):
    """What a prediction is made from."""

    ELEMENTS = "elements"
    LAST_PASS = "last pass"
    NEW_FIT = "new fit"

    @property
    def kind(self) -> PredictionKind:
        """What the names of the states call it."""
        return "FITTED" if self is Model.NEW_FIT else "TLE"


@dataclass(frozen=True, slots=True)
class Pointing:
    """A direction of the prediction at one instant."""

    az_deg: float  # continuous through north, see Prediction
    el_deg: float
    az_rate_deg_s: float
    el_rate_deg_s: float

    @property
    def is_finite(self) -> bool:
        """Whether all of it are numbers that an angle can have."""
        return (
            abs(self.az_deg) <= MOST_DEG
            and abs(self.el_deg) <= MOST_DEG
            and abs(self.az_rate_deg_s) <= MOST_DEG
            and abs(self.el_rate_deg_s) <= MOST_DEG
        )


@dataclass(frozen=True, slots=True)
class ZenithCrossing:
    """How an antenna whose azimuth drive is too slow crosses the zenith (pointing.keyhole).

    It leaves the path at the departure, at that continuous azimuth and rate, and is back on both at the return.
    peak_rate_deg_s: what the path asks for.  lost_s: seconds out of half the beam, from lost_from_tai_s on.
    """

    departure_tai_s: float
    return_tai_s: float
    departure_az_deg: float
    departure_rate_deg_s: float
    peak_rate_deg_s: float
    largest_error_deg: float
    lost_s: float
    lost_from_tai_s: float | None
    is_plunge: bool = False  # over the top, the elevation beyond 90 deg from then on (pointing.plunge)


@dataclass(frozen=True, slots=True)
class Prediction:
    """The prediction buffer: pointing at even steps, azimuth continuous through north (may leave [0, 360)).

    The arrays are (N,).  `follow_az_deg` and `follow_el_deg` are the path for an antenna that follows the registers:
    the path itself, for the elevation None, but where the azimuth drive is too slow (near the zenith), there one that
    it can follow (pointing.keyhole); `crossing` says how.  Over the top the path itself is the plunged antenna's from
    culmination on, the azimuth half a turn further.
    """

    start_tai_s: float
    step_s: float
    az_deg: Array
    el_deg: Array
    az_rate_deg_s: Array
    el_rate_deg_s: Array
    follow_az_deg: Array
    follow_az_rate_deg_s: Array
    kind: PredictionKind
    made_at_tai_s: float
    sigma_deg: Array | None = None
    model: Model = Model.ELEMENTS  # the kind, more closely
    spread: tuple[float, float] | None = None  # 1 sigma at made_at: along the track, s, and across it, deg
    late_drift_deg_s: Array | None = None  # (2, N): right and up, what a second of lateness moves beside `at`
    follow_el_deg: Array | None = None
    follow_el_rate_deg_s: Array | None = None
    crossing: ZenithCrossing | None = None

    @property
    def is_finite(self) -> bool:
        """Whether every sample of it is finite; a sigma may be infinite, but is a number."""
        arrays = (
            *(self.az_deg, self.el_deg, self.az_rate_deg_s, self.el_rate_deg_s),
            *(self.follow_az_deg, self.follow_az_rate_deg_s),
        )
        is_sigma = self.sigma_deg is None or not bool(np.isnan(self.sigma_deg).any())
        optional = (self.late_drift_deg_s, self.spread, self.follow_el_deg, self.follow_el_rate_deg_s)
        more = [one for one in optional if one is not None]
        return is_sigma and all(bool(np.isfinite(one).all()) for one in (*arrays, *more))

    @property
    def end_tai_s(self) -> float:
        return self.start_tai_s + self.step_s * (self.az_deg.size - 1)

    def seconds_inside(self, tai_s: float, limit_deg: float) -> float | None:
        """Seconds from an instant until 3 sigma exceed a limit, at most to the buffer's end; None without a sigma."""
        if self.sigma_deg is None:
            return None
        first = min(max(round((tai_s - self.start_tai_s) / self.step_s), 0), self.sigma_deg.size - 1)
        beyond = np.flatnonzero(~(self.sigma_deg[first:] <= limit_deg / 3.0))  # what is no number is beyond
        return self.step_s * float(beyond[0] if beyond.size else self.sigma_deg.size - 1 - first)

    def at(self, tai_s: float, *, follow: bool = False) -> Pointing | None:
        """Interpolate by cubic Hermite polynomials (smooth in rate); None outside the buffer."""
        x = (tai_s - self.start_tai_s) / self.step_s
        if not -1e-6 <= x <= self.az_deg.size - 1 + 1e-6:
            return None
        i = min(max(int(x), 0), self.az_deg.size - 2)
        if not follow and abs(float(self.az_deg[i + 1]) - float(self.az_deg[i])) > HALF_TURN_DEG and self._is_over:
            return self._beside_top(i if x - i < 0.5 else i + 1, x)
        az = self.follow_az_deg if follow else self.az_deg
        az_rate = self.follow_az_rate_deg_s if follow else self.az_rate_deg_s
        az_deg, az_rate_deg_s = _hermite(az, az_rate, i, x - i, self.step_s)
        el, el_rate = self.el_deg, self.el_rate_deg_s
        if follow and self.follow_el_deg is not None and self.follow_el_rate_deg_s is not None:
            el, el_rate = self.follow_el_deg, self.follow_el_rate_deg_s
        el_deg, el_rate_deg_s = _hermite(el, el_rate, i, x - i, self.step_s)
        return Pointing(az_deg, el_deg, az_rate_deg_s, el_rate_deg_s)

    @property
    def _is_over(self) -> bool:
        return self.crossing is not None and self.crossing.is_plunge

    def _beside_top(self, i: int, x: float) -> Pointing:
        """Over the top the path is the plunged antenna's from one sample on: between them nothing is interpolated."""
        since_s = (x - i) * self.step_s
        az_rate, el_rate = float(self.az_rate_deg_s[i]), float(self.el_rate_deg_s[i])
        az, el = float(self.az_deg[i]), float(self.el_deg[i])
        return Pointing(az + since_s * az_rate, el + since_s * el_rate, az_rate, el_rate)


def _hermite(y: Array, rate: Array, i: int, u: float, h: float) -> tuple[float, float]:
    y0, y1, d0, d1 = float(y[i]), float(y[i + 1]), float(rate[i]) * h, float(rate[i + 1]) * h
    a, b = 2 * (y0 - y1) + d0 + d1, 3 * (y1 - y0) - 2 * d0 - d1
    return ((a * u + b) * u + d0) * u + y0, ((3 * a * u + 2 * b) * u + d0) / h


@dataclass(frozen=True, slots=True)
class Pass:
    """A geometric pass above the station's lowest elevation."""

    rise_tai_s: float
    culmination_tai_s: float
    set_tai_s: float
    rise_az_deg: float
    culmination_el_deg: float
    culmination_az_deg: float
    set_az_deg: float
    hidden_tai_s: tuple[tuple[float, float], ...] = ()  # from and to: behind the station's skyline

    @property
    def duration_s(self) -> float:
        return self.set_tai_s - self.rise_tai_s


def sky_angle_deg(az1_deg: float, el1_deg: float, az2_deg: float, el2_deg: float) -> float:
    """Angle on the sky between two directions, well conditioned for small angles (haversine)."""
    d_el, d_az = radians(el2_deg - el1_deg), radians(az2_deg - az1_deg)
    h = sin(d_el / 2) ** 2 + cos(radians(el1_deg)) * cos(radians(el2_deg)) * sin(d_az / 2) ** 2
    return degrees(2 * asin(min(1.0, sqrt(max(0.0, h)))))  # beyond the zenith and before it: rounding

"""The settings of the estimators.  Pure."""

from dataclasses import dataclass
from math import inf

from acu_daemon.model import AngleBias, AxisLimits
from acu_daemon.orbit.propagator import EPHEMERIDES


@dataclass(frozen=True, slots=True)
class KalmanTuning:
    """Initial covariance and process noise of the Kalman filter (Kuga and Carrara 1988, 5.3), 1 sigma, degrees.

    The walks are per square root of a second of data.  Process noise is added to a state only while its sigma is below
    the floor.
    """

    sigma_raan_deg: float
    sigma_mean_anomaly_deg: float
    walk_raan_deg: float
    walk_mean_anomaly_deg: float
    floor_deg: float = inf


PAPER = KalmanTuning(1.0, 2.0, 0.01, 0.01, 0.05)  # Kuga and Carrara 1988, 5.3: readings at 1 Hz
DAEMON = KalmanTuning(0.2, 2.0, 5e-5, 2e-4)  # measured over a population of orbits: docs/decisions


@dataclass(frozen=True, slots=True)
class ElementSigmas:
    """What mean elements are worth, 1 sigma of each: the default for element sets (docs/decisions).

    Those of the mean motion and of the e-vector grow with the age of the elements.  e_vector: each of e cos argp and
    e sin argp.
    """

    raan_deg: float = 0.02
    mean_anomaly_deg: float = 1.0
    mean_motion_rad_min: float = 5e-7
    mean_motion_per_day_rad_min: float = 1e-6
    e_vector: float = 4e-5
    e_vector_per_day: float = 0.0
    inclination_deg: float = 0.007


BROUWER_SIGMAS = ElementSigmas(  # no long-period terms (0.4 km a day in the e-vector) and no drag
    raan_deg=0.03,
    mean_motion_rad_min=5e-6,
    mean_motion_per_day_rad_min=4e-6,
    e_vector=2e-4,
    e_vector_per_day=6e-5,
    inclination_deg=0.02,
)
EPHEMERIS_SIGMAS = ElementSigmas(  # of an orbit determination; the anomaly stays free for a manoeuvre, a wrong clock
    raan_deg=0.005,
    mean_motion_rad_min=1e-7,
    mean_motion_per_day_rad_min=3e-7,
    e_vector=1e-5,
    inclination_deg=0.002,
)
_BY_KIND = {"brouwer": BROUWER_SIGMAS, **dict.fromkeys(EPHEMERIDES, EPHEMERIS_SIGMAS)}


@dataclass(frozen=True, slots=True)
class StateSigmas:
    """What a state is worth at the epoch, 1 sigma of each component of position and of velocity."""

    position_m: float
    velocity_m_s: float


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """What an estimator must know beside orbit and site.

    Noise is 1 sigma, across the elevation (azimuth x cos(el)) and in elevation; `full` adds the cot term x cot(el) to
    the elevation's.  Without axis limits no path counts as too hard.  inversion_count: consecutive inversions that
    `circular` averages, 3 to 8 (Aguirre and Medeiros 1988, 2.6c).

    For `full`: the biases' sigmas (model.AngleBias), those of NPAE, AN, AW and TF, the orbit's (None: from the kind of
    elements and their age) and the station's, east and north each, metres.  For the others: known_bias, what the
    encoders are known to show beyond the antenna model.
    """

    sigma_azimuth_deg: float = 0.05
    sigma_elevation_deg: float = 0.05
    max_fit_elevation_deg: float = 80.0
    beamwidth_deg: float = 1.0
    azimuth: AxisLimits | None = None
    elevation: AxisLimits | None = None
    inversion_count: int = 8
    kalman: KalmanTuning = DAEMON
    sigma_elevation_cot_deg: float = 0.0
    bias_sigma_azimuth_deg: float = 0.1
    bias_sigma_azimuth_sec_deg: float = 0.003
    bias_sigma_elevation_deg: float = 0.1
    bias_sigma_elevation_cot_deg: float = 0.0
    mount_sigmas_deg: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    is_collimation_surveyed: bool = False
    known_bias: AngleBias = AngleBias()
    orbit_sigmas: ElementSigmas | StateSigmas | None = None
    station_sigma_m: float = 0.0

    def sigmas_of(self, kind: str) -> ElementSigmas | StateSigmas:
        """What the orbit of a source is worth: as configured, else by its kind."""
        return self.orbit_sigmas or _BY_KIND.get(kind, ElementSigmas())

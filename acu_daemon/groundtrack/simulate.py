"""One simulated year (or less) of a satellite that keeps its own ground track: the parts of the loop, put together."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from acu_daemon.errors import UsageError
from acu_daemon.groundtrack.control_loop import Controller, Flown, OrbitNavigator, fly
from acu_daemon.groundtrack.environment import (
    EPOCH_TAI_S,
    STEP_S,
    Flux,
    FreeMotion,
    Spacecraft,
    even_steps,
    free_motion,
    node_rad,
)
from acu_daemon.groundtrack.gps import Ripple, TrueOrbit
from acu_daemon.groundtrack.navigator import Navigator, NavigatorSetup
from acu_daemon.groundtrack.our_controller import FORECAST_S, NOISE_M, Forecast, OurController, OurSettings
from acu_daemon.groundtrack.paper_controller import ConstantController, PaperController, PaperSettings
from acu_daemon.groundtrack.paper_navigator import PaperNavigator
from acu_daemon.groundtrack.polynomials import DriftPolynomials, drag_forecast, fit_polynomials
from acu_daemon.groundtrack.smoothing import RECURSION, WINDOW
from acu_daemon.units import DAY_S, Array

PAPER, OURS, PERFECT, CONSTANT = "paper", "ours", "perfect", "constant"
CONTROLLERS, NAVIGATORS = (OURS, PAPER, CONSTANT), (OURS, PAPER, PERFECT)
SHAPE_DEGREE = 8  # of the logarithm's polynomial over fluxes from 0 on; the paper's degree is enough from 65 on
PAPER_NAVIGATOR_NOISE_M = 150.0  # of an hour's mean of D: the tesserals that it does not know
DENSITY_TIME_DAYS = 20.0  # how long a departure of the true density from the model lasts
CONSTANT_WINDOW_S = 3.0 * 3600.0
_FORECAST_SPARE_DAYS = FORECAST_S / DAY_S


class Windows(NamedTuple):
    """Hours over which the paper's controller smooths D and dD/dt."""

    d_h: float
    rate_h: float


class PaperRun(NamedTuple):
    """A run of Galski and Orlando 2011, section 3, what came out, and the acceleration's scale that fits its count."""

    profile: str
    band_m: float
    windows: Windows
    manoeuvre_count: int
    sum_m: float
    largest_m: float
    smallest_m: float
    fitted_scale: float


PAPER_RUNS = (
    PaperRun("moderate", 3900.0, Windows(3.0, 6.0), 17, 2092.4, 175.9, 45.0, 0.35),
    PaperRun("moderate", 100.0, Windows(8.0, 20.0), 146, 2178.7, 23.9, 6.1, 0.60),
    PaperRun("critical", 3900.0, Windows(8.0, 40.0), 26, 2953.0, 324.5, 21.7, 0.30),
    PaperRun("critical", 100.0, Windows(8.0, 25.0), 148, 2946.7, 64.0, 3.6, 0.50),
)


@dataclass(frozen=True, slots=True)
class Case:
    """What is simulated."""

    profile: str
    band_m: float
    controller: str = OURS
    navigator: str = OURS
    days: float = 365.0
    seed: int = 0
    execution_sigma: float = 0.02
    density_sigma: float = 0.0  # 1 sigma by which the true density departs from the model, of itself
    acceleration_scale: float = 1.0  # of the paper's controller
    windows: Windows | None = None  # of the paper's controller; None: as the paper has them for a like run
    smoothing: str = RECURSION
    has_semi_annual: bool = True
    constant_m: float = 3.0  # of the constant controller's steps


@dataclass(frozen=True, slots=True)
class World:
    """What every run of a campaign shares: flux, satellite, tables of the tesserals, polynomials."""

    flux: Flux
    craft: Spacecraft
    polynomials: DriftPolynomials
    ripple: Ripple | None = None
    known_ripple: Ripple | None = None

    @property
    def start_tai_s(self) -> float:
        """When a run begins: in 2010 where the flux covers it, as the package's own do, else with its first day."""
        is_covered = self.flux.start_tai_s <= EPOCH_TAI_S < self.flux.end_tai_s
        return EPOCH_TAI_S if is_covered else self.flux.start_tai_s


class CaseOutcome(NamedTuple):
    """A case and what came of it; `bound_count`: how few manoeuvres the whole band could do with."""

    case: Case
    flown: Flown
    free: FreeMotion
    bound_count: float


def make_world(
    flux: Flux, ripple: Ripple | None = None, known_ripple: Ripple | None = None, craft: Spacecraft | None = None
) -> World:
    """The shared part, with the polynomials fitted to the satellite's own runs."""
    chosen = craft or Spacecraft()
    polynomials, _ = fit_polynomials(chosen, SHAPE_DEGREE)
    return World(flux, chosen, polynomials, ripple, known_ripple)


def simulate(world: World, case: Case, on_day: Callable[[float], None] | None = None) -> CaseOutcome:
    """Run a case; the same seed gives the same outcome, bit for bit.

    Raises:  UsageError: a case that cannot be run; the profile ends before the case does.
    """
    check_case(world, case)
    of_density, of_loop = np.random.default_rng(case.seed).spawn(2)
    free = free_motion(
        world.craft,
        case.days,
        world.flux,
        start_tai_s=world.start_tai_s,
        has_semi_annual=case.has_semi_annual,
        density_factor=_density_factor(case, of_density),
    )
    node = node_rad(world.craft, world.start_tai_s)
    flown = fly(
        TrueOrbit(free, node, world.ripple),
        _navigator(case.navigator, NavigatorSetup(world.craft.reference, node, world.known_ripple, world.start_tai_s)),
        _controller(world, case),
        case.days,
        of_loop,
        execution_sigma=case.execution_sigma,
        on_day=on_day,
    )
    return CaseOutcome(case, flown, free, bound_count(free, case.band_m))


def check_case(world: World, case: Case) -> None:
    """UsageError: the case cannot be run."""
    if case.controller not in CONTROLLERS:
        raise UsageError(f"--controller {case.controller}: expected one of {', '.join(CONTROLLERS)}")
    if case.navigator not in NAVIGATORS:
        raise UsageError(f"--navigator {case.navigator}: expected one of {', '.join(NAVIGATORS)}")
    if case.smoothing not in (RECURSION, WINDOW):
        raise UsageError(f"--smoothing {case.smoothing}: expected {RECURSION} or {WINDOW}")
    if not 10.0 <= case.band_m <= 1e5:
        raise UsageError(f"--band-m {case.band_m:g}: expected half the band's width, 10 to 100000 m")
    covered = (world.flux.end_tai_s - world.start_tai_s) / DAY_S
    if not 1.0 <= case.days <= covered:
        raise UsageError(
            f"--days {case.days:g}: expected 1 to {covered:.0f}, the days the profile {case.profile} covers"
        )


def bound_count(free: FreeMotion, band_m: float) -> float:
    """The least number of manoeuvres: every parabola fills the band, integral of sqrt(D'' / (16 L)) dt.

    A parabola of the acceleration c falls through a band of the width 2 L and comes back in sqrt(16 L / c).
    """
    acceleration = np.maximum(free.drag_m_s2 + free.lunisolar_m_s2, 0.0)
    return float(np.sum(np.sqrt(acceleration / (16.0 * band_m)))) * free.step_s


def drag_less_lunisolar_m(free: FreeMotion) -> float:
    """The semi-major axis that has to be given back: what drag took, less what Sun and Moon save."""
    westward_m_s = -float(np.sum(free.lunisolar_m_s2)) * free.step_s
    return -float(free.a_m[-1]) - westward_m_s / -free.craft.reference.by_a.drift


def _navigator(kind: str, setup: NavigatorSetup) -> OrbitNavigator | None:
    if kind == PERFECT:
        return None
    return PaperNavigator(setup) if kind == PAPER else Navigator(setup)


def _controller(world: World, case: Case) -> Controller:
    reference = world.craft.reference
    days = case.days + _FORECAST_SPARE_DAYS
    sky = free_motion(world.craft, days, None, start_tai_s=world.start_tai_s).lunisolar_m_s2
    tai_s = even_steps(world.start_tai_s, STEP_S, sky.size)
    coarse = tai_s[::20]
    drag = drag_forecast(world.craft, world.polynomials, coarse, world.flux, has_semi_annual=case.has_semi_annual)
    drag = np.interp(tai_s, coarse, drag)
    if case.controller == OURS:
        noise_m = PAPER_NAVIGATOR_NOISE_M if case.navigator == PAPER else NOISE_M
        ours = OurSettings(case.band_m, -case.band_m, case.execution_sigma, noise_m)
        return OurController(ours, reference, Forecast(STEP_S, drag, sky))
    windows = case.windows or paper_windows(case.profile, case.band_m)
    if case.controller == CONSTANT:
        return ConstantController(case.constant_m, reference, STEP_S, CONSTANT_WINDOW_S)
    settings = PaperSettings(
        case.band_m,
        -case.band_m,
        windows.d_h * 3600.0,
        windows.rate_h * 3600.0,
        case.smoothing,
        case.acceleration_scale,
    )
    return PaperController(settings, reference, STEP_S, drag + float(sky.mean()))


def paper_windows(profile: str, band_m: float) -> Windows:
    """The paper's windows for the run that is most like this one."""
    like = [run for run in PAPER_RUNS if run.profile == profile] or list(PAPER_RUNS[:2])
    return min(like, key=lambda run: abs(np.log(run.band_m / band_m))).windows


def _density_factor(case: Case, rng: np.random.Generator) -> Array | None:
    """What the true density is times the model's, day by day: its logarithm wanders and comes back."""
    if case.density_sigma == 0.0:
        return None
    fade = np.exp(-1.0 / DENSITY_TIME_DAYS)
    draws = rng.normal(0.0, case.density_sigma, int(case.days) + 3)
    logarithm = np.empty_like(draws)
    logarithm[0] = draws[0]
    for day in range(1, draws.size):
        logarithm[day] = fade * logarithm[day - 1] + np.sqrt(1.0 - fade**2) * draws[day]
    return np.exp(logarithm)

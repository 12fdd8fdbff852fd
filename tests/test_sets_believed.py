"""Whether a new set of elements is believed, and between which times SGP4's answers are: each limit from both sides."""

from collections.abc import Callable
from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest
from made_oems import iss
from test_decay import REENTERING, only_set

from acu_daemon.orbit.aging import expected_error
from acu_daemon.orbit.believed import DECAYED, INSIDE_EARTH, NO_END, TOO_LARGE, BelievedSpan, States, believed_span
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.set_judgement import MOST_SIGMAS, Judged, Judgement, judge
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

OLD = iss().elements

# A new set


def later(old: ElementSet, **changes: float) -> ElementSet:
    """A set a second later that puts the satellite where the old one does, to metres, but for the changes."""
    new = replace(old, epoch_tai_s=old.epoch_tai_s + 1.0)
    new = replace(new, mean_anomaly_rad=old.mean_anomaly_rad + old.mean_motion_rad_s)
    return replace(new, **{name: getattr(new, name) + by for name, by in changes.items()})


def test_the_first_set_is_believed_whatever_it_says() -> None:
    assert judge(None, OLD) == Judgement(Judged.NEWER)


@pytest.mark.parametrize(("by_s", "judged"), [(-1e-3, Judged.OLDER), (0.0, Judged.SAME), (1e-3, Judged.NEWER)])
def test_a_set_is_older_the_same_or_newer_by_its_epoch_alone(by_s: float, judged: Judged) -> None:
    new = replace(OLD, epoch_tai_s=OLD.epoch_tai_s + by_s)
    assert judge(OLD, new).judged is judged
    if by_s <= 0.0:
        far = replace(new, mean_anomaly_rad=OLD.mean_anomaly_rad + 1.0)
        assert judge(OLD, far) == Judgement(judged)


@pytest.mark.parametrize("name", ["mean_anomaly_rad", "raan_rad"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(("sigmas", "judged"), [(4.99, Judged.NEWER), (5.01, Judged.DOUBTFUL)])
def test_a_shift_of_five_sigmas_along_the_track_or_across_it_is_doubtful(
    name: str, sign: float, sigmas: float, judged: Judged
) -> None:
    assert MOST_SIGMAS == 5.0
    by_rad = 1e-3
    at = np.array([OLD.epoch_tai_s + 1.0])
    places_m = [Sgp4Propagator(later(OLD, **{name: one})).states_teme(at)[0] for one in (0.0, by_rad)]
    m_per_rad = float(np.linalg.norm(places_m[1] - places_m[0])) / by_rad
    sigma_m = float(np.hypot(*(expected_error(one, float(at[0])).along_m for one in (OLD, later(OLD)))))
    found = judge(OLD, later(OLD, **{name: sign * sigmas * sigma_m / m_per_rad}))
    assert found.judged is judged
    assert found.shift_m == pytest.approx(sigmas * sigma_m, rel=1e-3)
    assert found.sigma_m == sigma_m > 1414.0


def test_what_both_sets_are_expected_to_be_off_counts() -> None:
    days = 20.0
    new = replace(OLD, epoch_tai_s=OLD.epoch_tai_s + days * DAY_S)
    found = judge(OLD, new)
    of_old, of_new = (expected_error(one, new.epoch_tai_s).along_m for one in (OLD, new))
    assert found.sigma_m == pytest.approx(np.hypot(of_old, of_new))
    assert of_old > 10.0 * of_new


def test_a_set_after_the_decay_by_the_one_before_is_doubtful() -> None:
    old = only_set(REENTERING)
    found = judge(old, replace(old, epoch_tai_s=old.epoch_tai_s + 5.0 * DAY_S))
    assert found == Judgement(Judged.DOUBTFUL, inf)
    assert str(found) == "the elements before it have no position there"


@pytest.mark.parametrize(("sigma_m", "said"), [(1000.0, "8"), (0.0, "many")])
def test_a_doubt_is_told_in_kilometres_and_sigmas(sigma_m: float, said: str) -> None:
    found = Judgement(Judged.DOUBTFUL, 7600.0, sigma_m)
    assert str(found) == f"it puts the satellite 8 km, {said} sigma, from where the elements before it do"


# SGP4's answers

A_M = 7.0e6
A_FEW_SECONDS_DAYS = 10.0 / DAY_S


def at_perigee(a_m: Array, e: float) -> tuple[Array, Array]:
    """Places and velocities (N, 3) at the perigee of orbits with these axes."""
    nothing = np.zeros_like(a_m)
    r_m = np.stack([a_m * (1.0 - e), nothing, nothing], axis=1)
    speed = np.sqrt(MU_M3_S2 * (1.0 + e) / (a_m * (1.0 - e)))
    return r_m, np.stack([nothing, speed, nothing], axis=1)


def answers(
    axis_m: Callable[[Array], Array], e: float = 0.0, code: Callable[[Array], Array] = np.zeros_like
) -> Callable[[Array], States]:
    """SGP4's answers of a satellite whose axis, and whose error, are told by the days since the epoch."""

    def states(days: Array) -> States:
        return (code(days).astype(np.uint8), *at_perigee(axis_m(days), e))

    return states


def steady(days: Array) -> Array:
    return np.full(days.shape, A_M)


def test_an_orbit_that_stays_is_believed_for_ever() -> None:
    assert believed_span(answers(steady), A_M, 0.0) == BelievedSpan(-inf, inf, NO_END, NO_END)


@pytest.mark.parametrize("end_days", [0.3, 0.9999, 1.0001, 8.25, 300.0, 7000.0])
@pytest.mark.parametrize("side", [-1, 1])
def test_it_ends_at_the_first_error_to_a_few_seconds(side: int, end_days: float) -> None:
    states = answers(steady, code=lambda days: np.where(side * days > end_days, DECAYED, 0))
    found = believed_span(states, A_M, 0.0)
    ends, errors = (found.first_days, found.last_days), (found.error_before, found.error_after)
    near, far = (ends[1], ends[0]) if side > 0 else (-ends[0], -ends[1])
    assert end_days - near == pytest.approx(0.0, abs=max(A_FEW_SECONDS_DAYS, 3e-6 * end_days))
    assert near <= end_days
    assert far == -inf
    assert errors == ((NO_END, DECAYED) if side > 0 else (DECAYED, NO_END))


def test_what_is_answered_after_an_error_is_not_believed() -> None:
    def code(days: Array) -> Array:
        return np.where((days > 3.0) & (days < 4.0), 4, np.where(days >= 4.0, 0, 0))

    found = believed_span(answers(steady, code=code), A_M, 0.0)
    assert (found.first_days, found.error_after) == (-inf, 4)
    assert found.last_days == pytest.approx(3.0, abs=A_FEW_SECONDS_DAYS)


def test_of_two_errors_the_first_from_the_epoch_on_is_told_on_either_side() -> None:
    def code(days: Array) -> Array:
        return np.select([days > 5.0, days > 2.0, days < -6.0, days < -4.0], [1, 6, 2, 3], 0)

    found = believed_span(answers(steady, code=code), A_M, 0.0)
    assert (found.error_before, found.error_after) == (3, 6)
    assert found.first_days == pytest.approx(-4.0, abs=A_FEW_SECONDS_DAYS)


def test_where_the_epoch_itself_is_bad_nothing_is_believed() -> None:
    found = believed_span(answers(steady, code=lambda days: np.full(days.shape, DECAYED)), A_M, 0.0)
    assert (abs(found.first_days), found.last_days) == (0.0, 0.0)
    assert (found.error_before, found.error_after) == (DECAYED, DECAYED)


@pytest.mark.parametrize("e", [0.0, 0.2, 0.6])
@pytest.mark.parametrize("side", [-1, 1])
def test_an_axis_may_be_larger_by_a_share_and_by_what_the_flattening_adds(side: int, e: float) -> None:
    a_m = 20.0e6
    limit_m = (1.15 + 0.01 / (1.0 - e)) * a_m
    states = answers(lambda days: np.where(days > 2.0, limit_m * (1.0 + side * 1e-9), a_m), e)
    found = believed_span(states, a_m, e)
    assert (found.error_before, found.error_after) == (NO_END, TOO_LARGE if side > 0 else NO_END)
    assert (found.last_days < 2.1) == (side > 0)


@pytest.mark.parametrize("speed", [np.sqrt(2.0) * 1.01, nan])
def test_what_is_no_ellipse_is_too_large(speed: float) -> None:
    def states(days: Array) -> States:
        r_m, v_m_s = at_perigee(steady(days), 0.0)
        return np.zeros(days.shape, np.uint8), r_m, v_m_s * np.where(days > 2.0, speed, 1.0)[:, None]

    assert believed_span(states, A_M, 0.0).error_after == TOO_LARGE


@pytest.mark.parametrize("a_m", [7.0e6, 29.0e6, 60.0e6])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_perigee_may_be_inside_the_earth_by_30_km_and_of_a_high_orbit_by_much_more(side: int, a_m: float) -> None:
    spare_m = 30e3 * max(a_m / 30e6, 1.0) ** 4
    low_m = EARTH_EQUATORIAL_RADIUS_M - spare_m
    e = 1.0 - (EARTH_EQUATORIAL_RADIUS_M + 100e3) / a_m

    def states(days: Array) -> States:
        shares = np.where(days > 2.0, low_m * (1.0 - side * 1e-9), a_m * (1.0 - e))
        r_m, v_m_s = np.zeros((days.size, 3)), np.zeros((days.size, 3))
        r_m[:, 1] = shares
        v_m_s[:, 2] = np.sqrt(MU_M3_S2 * (2.0 / shares - 1.0 / a_m))
        return np.zeros(days.shape, np.uint8), r_m, v_m_s

    found = believed_span(states, a_m, e)
    assert (found.error_before, found.error_after) == (NO_END, INSIDE_EARTH if side > 0 else NO_END)


@pytest.mark.parametrize(("low_m", "error"), [(EARTH_EQUATORIAL_RADIUS_M - 1.0, NO_END), (7.0e6, INSIDE_EARTH)])
def test_of_elements_with_their_perigee_inside_the_earth_sgp4s_own_errors_remain(low_m: float, error: int) -> None:
    e = 0.5
    a_m = low_m / (1.0 - e)
    states = answers(lambda days: np.where(days > 2.0, 5.0e6 / (1.0 - e), a_m), e)
    assert believed_span(states, a_m, e).error_after == error


def test_an_error_of_sgp4_counts_before_what_its_answer_looks_like() -> None:
    states = answers(lambda days: np.where(days > 2.0, 1e9, A_M), code=lambda days: np.where(days > 2.0, 4, 0))
    assert believed_span(states, A_M, 0.0).error_after == 4


def test_a_smaller_orbit_outside_the_earth_is_believed() -> None:
    states = answers(lambda days: np.where(days > 2.0, 6.5e6, A_M))
    assert believed_span(states, A_M, 0.0).error_after == NO_END

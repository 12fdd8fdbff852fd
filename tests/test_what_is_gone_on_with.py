"""What another fit left: each state up to five sigmas with each sign, each thing that must be the same, alone."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site
from test_every_state import settings

from acu_daemon.assist.estimators.full.carry_over import (
    LONGEST_S,
    CarryOver,
    carry_over_of,
    frame_of,
    resume_of,
    why_not,
    why_not_resume,
    why_other_frame,
)
from acu_daemon.assist.estimators.full.estimated_states import STATE_COUNT, bias_of, correction_of, make_prior, shift_of
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Correction, FitResult, Site
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.refraction import traced

SOURCE, WHERE = circular(66.0, 0.01), site(5.0)
SETTINGS: EstimatorSettings = settings(range(STATE_COUNT))
AT = EPOCH_TAI_S + 1000.0
PRIOR = make_prior(SOURCE, SETTINGS, AT).covariance
SIGMAS = np.sqrt(np.diag(PRIOR))
IN_AIR = replace(WHERE, antenna=AntennaModel(Mount(), traced(320.0, WHERE.station)))
CROOKED = replace(WHERE, antenna=AntennaModel(Mount(an_deg=0.01)))


def left(x: np.ndarray, covariance: np.ndarray = PRIOR, where: Site = WHERE) -> CarryOver:
    """By a fit with the states x."""
    fit = FitResult(
        "full", correction_of(x), AT, 99, 0, 0.0, 0.0, 0.0, bias_of(x), shift_of(x), covariance=0.01 * covariance
    )
    carried = carry_over_of(fit, SOURCE, where)
    assert carried is not None
    return carried


NOTHING = left(np.zeros(STATE_COUNT))


def resumed(carried: CarryOver, **more: Any) -> str:
    given: dict[str, Any] = {"source": SOURCE, "site": WHERE, "estimator": "full", "settings": SETTINGS}
    given |= {"now_tai_s": AT, "has_covariance": True}
    return why_not_resume(carried, **given | more)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("state", range(STATE_COUNT))
def test_each_state_is_gone_on_with_up_to_five_sigmas_and_called_by_its_name_beyond(state: int, sign: float) -> None:
    words = "correction" if state < 6 else "shift of the station" if 10 <= state < 13 else "biases"
    for share, is_taken in ((0.999, True), (1.001, False)):
        x = np.zeros(STATE_COUNT)
        x[state] = sign * share * 5.0 * SIGMAS[state]
        said = why_not(left(x), SOURCE, SETTINGS, AT)
        assert said == "" if is_taken else words in said
        if state >= 6:  # of the orbit the same pass may go on from a wider prior
            assert resumed(left(x)) == said


@pytest.mark.parametrize("state", range(STATE_COUNT))
def test_each_sigma_is_gone_on_with_up_to_five_times_what_was_known_before(state: int) -> None:
    for share, is_taken in ((0.999, True), (1.001, False)):
        covariance = 0.01 * PRIOR
        covariance[state, state] = (share * 5.0 * SIGMAS[state]) ** 2
        said = why_not(replace(NOTHING, covariance=covariance), SOURCE, SETTINGS, AT)
        assert said == ("" if is_taken else "its covariance is not that of a fit")
    covariance[state, state] = 0.0
    said = why_not(replace(NOTHING, covariance=covariance), SOURCE, SETTINGS, AT)
    assert said == ("its covariance is not that of a fit" if state < 6 else "")


@pytest.mark.parametrize("row", [0, 1])
@pytest.mark.parametrize("component", range(6))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_elements_are_others_as_soon_as_one_component_of_one_state_is(row: int, component: int, sign: float) -> None:
    for share, is_same in ((0.99, True), (1.01, False)):
        states = NOTHING.states.copy()
        states[row, component] += sign * share * (1.0 if component < 3 else 1e-3)
        other = replace(NOTHING, states=states)
        for said in (why_not(other, SOURCE, SETTINGS, AT), resumed(other)):
            assert said == ("" if is_same else "the elements have changed")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, ""),
        ({"estimator": "kalman"}, "the station or the estimator has changed"),
        *(
            ({"station": replace(WHERE.station, **{name: value})}, "the station or the estimator has changed")
            for name, value in {"name": "x", "latitude_deg": 5.1, "longitude_deg": 0.1, "height_m": 1.0}.items()
        ),
        ({"elements_kind": "tle"}, "the elements have changed"),
        ({"elements_epoch_tai_s": EPOCH_TAI_S + 1.0}, "the elements have changed"),
        ({"frame": frame_of(CROOKED)}, "[atmosphere] refraction or [mount] has changed"),
        ({"frame": frame_of(IN_AIR)}, "[atmosphere] refraction or [mount] has changed"),
    ],
)
def test_a_pass_is_gone_on_with_only_where_all_is_the_same(change: dict[str, Any], said: str) -> None:
    assert resumed(replace(NOTHING, **change)) == said


@pytest.mark.parametrize(
    ("age_s", "is_taken"),
    [(-1e-3, False), (0.0, True), (LONGEST_S, True), (LONGEST_S + 1e-3, False)],
)
def test_what_was_left_is_of_use_from_its_own_time_on_for_ten_days(age_s: float, is_taken: bool) -> None:
    """The elements are at their epoch, so that their age is no matter."""
    carried = replace(NOTHING, at_tai_s=AT)
    assert (why_not(carried, SOURCE, SETTINGS, AT + age_s) == "") is is_taken
    assert (resumed(carried, now_tai_s=AT + age_s) == "") is is_taken


@pytest.mark.parametrize("is_other_station", [False, True])
@pytest.mark.parametrize("was", [WHERE, IN_AIR, CROOKED], ids=["vacuum", "air", "crooked"])
@pytest.mark.parametrize("now", [WHERE, IN_AIR, CROOKED], ids=["vacuum", "air", "crooked"])
def test_of_another_station_the_orbit_is_taken_whatever_its_mount_but_not_from_air_to_none(
    was: Site, now: Site, is_other_station: bool
) -> None:
    assert len({frame_of(one) for one in (WHERE, IN_AIR, CROOKED)}) == 3
    station = replace(now.station, latitude_deg=9.0) if is_other_station else now.station
    said = why_other_frame(replace(NOTHING, frame=frame_of(was)), replace(now, station=station))
    is_same_air = (was is IN_AIR) == (now is IN_AIR)
    assert (said == "") is (is_same_air if is_other_station else was is now)


def test_too_few_readings_leave_nothing_to_the_next_pass_and_one_is_enough_for_the_same() -> None:
    fit = FitResult("full", Correction(), AT, 30, 0, 0.0, 0.0, 0.0, covariance=PRIOR)
    assert carry_over_of(fit, SOURCE, WHERE) is not None
    assert carry_over_of(replace(fit, reading_count=29), SOURCE, WHERE) is None
    assert carry_over_of(replace(fit, covariance=None), SOURCE, WHERE) is None
    kept = resume_of(replace(fit, reading_count=1, covariance=None), SOURCE, WHERE)
    assert kept is not None
    assert kept.is_of_this_pass
    assert resumed(kept, has_covariance=False) == ""
    assert resumed(kept) == "its covariance is not that of a fit"
    assert resume_of(replace(fit, reading_count=0), SOURCE, WHERE) is None

"""How long a wrong lock is believed against the satellite's own readings: by its length, the levels, and the offset."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from made_orbits import circular, site, visible
from real_passes import noisy

from acu_daemon.assist.estimators.full.carry_over import resume_of
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AxisLimits, Correction, Model, Readings, sky_angle_deg
from acu_daemon.orbit.look import look_at

AZIMUTH = AxisLimits(-270.0, 270.0, 20.0, 10.0)
ELEVATION = AxisLimits(0.0, 90.0, 5.0, 5.0)
SETTINGS = EstimatorSettings(0.03, 0.03, azimuth=AZIMUTH, elevation=ELEVATION)
WHERE, SOURCE = site(6.0, 3.0), circular()
LEVEL_DB = 10.0
LEAST_S, MOST_S, SHARE = 10.0, 75.0, 3.0  # decision 0017: three times what was kept, within these
EVERY_S = 4.0 + 1.0  # it is looked at so often, in batches of a second


def needed_s(wrong_s: float, rise_db: float | None) -> float:
    """Decision 0017, for a wrong lock on an orbit as likely as the satellite's own."""
    as_long_s = min(max(SHARE * wrong_s, LEAST_S), MOST_S)
    if rise_db is not None and rise_db > 6.0:
        return LEAST_S
    return 2.0 * as_long_s if rise_db is not None and rise_db < -3.0 else as_long_s


@cache
def gave_way_s(wrong_s: int, off: Correction, rise_db: float | None, most_s: int) -> float | None:
    """Seconds of the satellite's own readings until they took the place of the others; None: not within most_s."""
    tai_s = visible(SOURCE, WHERE, 1.0)[60 : 60 + wrong_s + most_s]
    wrong = look_at(SOURCE.corrected(off), tai_s, WHERE)
    own = look_at(SOURCE, tai_s, WHERE)
    is_wrong = np.arange(tai_s.size) < wrong_s
    az_deg, el_deg = np.where(is_wrong, wrong.az_deg, own.az_deg), np.where(is_wrong, wrong.el_deg, own.el_deg)
    readings = noisy(az_deg, el_deg, tai_s, 0.03, np.random.default_rng(4))
    if rise_db is not None:
        agc_db = np.where(is_wrong, LEVEL_DB, LEVEL_DB + rise_db)
        readings = Readings(readings.tai_s, readings.az_deg, readings.el_deg, agc_db)
    refitter = Refitter(RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH))
    for k in range(tai_s.size):
        now = float(tai_s[k])
        reply = refitter.refit(RefitRequest(readings.part(slice(k, k + 1)), now, 2.0, now, 180.0))
        if reply.gate.reset_count:
            return float(k - wrong_s)
        assert k < 1 or k >= wrong_s or reply.fit is not None  # it was believed
    return None


LATE, EARLY = Correction(delta_mean_anomaly_rad=-0.012), Correction(delta_mean_anomaly_rad=0.012)
UNLIKELY = Correction(delta_raan_rad=0.004)  # 11 sigmas of the elements' node


@pytest.mark.parametrize("rise_db", [None, 0.0, 2.0, -2.5, 7.0, -4.0])
@pytest.mark.parametrize(("wrong_s", "off"), [(6, EARLY), (12, LATE)])
def test_a_wrong_lock_gives_way_after_three_times_its_length_sooner_or_later_by_the_level(
    wrong_s: int, rise_db: float | None, off: Correction
) -> None:
    needed = needed_s(wrong_s, rise_db)
    after_s = gave_way_s(wrong_s, off, rise_db, int(needed + 3 * EVERY_S))
    assert after_s is not None
    assert needed <= after_s <= needed + EVERY_S


@pytest.mark.long
@pytest.mark.parametrize(("wrong_s", "off", "rise_db", "needed"), [(32, EARLY, 0.0, MOST_S)])
def test_a_wrong_lock_however_long_gives_way_after_75_s(
    wrong_s: int, off: Correction, rise_db: float, needed: float
) -> None:
    after_s = gave_way_s(wrong_s, off, rise_db, int(needed + 3 * EVERY_S))
    assert after_s is not None
    assert needed <= after_s <= needed + EVERY_S


@pytest.mark.parametrize(("rise_db", "needed"), [(None, LEAST_S), (0.0, 36.0), (-2.0, 36.0)])
def test_a_wrong_lock_on_an_unlikely_orbit_gives_way_at_once_only_where_nobody_knows_the_level(
    rise_db: float | None, needed: float
) -> None:
    after_s = gave_way_s(12, UNLIKELY, rise_db, int(needed + 3 * EVERY_S))
    assert after_s is not None
    assert needed <= after_s <= needed + EVERY_S


@pytest.mark.long
def test_a_wrong_lock_that_a_daemon_started_again_has_gone_on_from_goes_whole_when_it_gives_way() -> None:
    tai_s = visible(SOURCE, WHERE, 1.0)[60:100]
    wrong, own = look_at(SOURCE.corrected(UNLIKELY), tai_s, WHERE), look_at(SOURCE, tai_s, WHERE)
    is_wrong = np.arange(tai_s.size) < 20
    az_deg, el_deg = np.where(is_wrong, wrong.az_deg, own.az_deg), np.where(is_wrong, wrong.el_deg, own.el_deg)
    readings = noisy(az_deg, el_deg, tai_s, 0.03, np.random.default_rng(4))
    setup = RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH)

    def replies(refitter: Refitter, first: int, last: int) -> Iterator[tuple[int, RefitReply]]:
        for k in range(first, last):
            now = float(tai_s[k])
            yield k, refitter.refit(RefitRequest(readings.part(slice(k, k + 1)), now, 2.0, now, 180.0))

    *_, (_, before) = replies(Refitter(setup), 0, 10)
    assert before.fit is not None
    resumed = Refitter(replace(setup, carried=resume_of(before.fit, SOURCE, WHERE)))
    k, gave_way = next((k, reply) for k, reply in replies(resumed, 10, 40) if reply.gate.reset_count)
    point = gave_way.prediction.at(float(tai_s[k]))
    assert gave_way.model is Model.NEW_FIT  # of the new readings alone, at once
    assert point is not None
    assert sky_angle_deg(point.az_deg, point.el_deg, float(own.az_deg[k]), float(own.el_deg[k])) < 0.05

"""Why readings are off the path, by where they are, how they move and how strong they are; and since when."""

import numpy as np
import pytest

from acu_daemon.assist.reading_gate import OFF_PATH, SIDE_LOBE, WRONG_TARGET
from acu_daemon.assist.screening.off_path_reason import left_path_tai_s, reason_of, rise_db
from acu_daemon.assist.screening.offsets import Offsets
from acu_daemon.assist.screening_limits import BEFORE_S, DRIFT_BEAMS_S, LOW_DB, RECENT_S, SIDE_LOBE_BEAMS
from acu_daemon.model import Readings

NOW, BEAM_DEG, NOISE_DEG = 8.4e8, 1.0, 0.02
WAYS = [(1.0, 0.0), (-1.0, 1.0), (0.0, -1.0), (-1.0, -1.0)]


def beside(beams: float, way: tuple[float, float], drift_deg_s: float = 0.0, span_s: float = RECENT_S) -> Offsets:
    """Readings so far to one side, which drift away on it."""
    t = np.arange(0.0, span_s, 0.1)
    noise = NOISE_DEG * np.random.default_rng(3).normal(size=(2, t.size))
    right, up = np.array(way) / np.hypot(*way)
    far = beams * BEAM_DEG + drift_deg_s * t
    return Offsets(NOW + t, right * far + noise[0], up * far + noise[1], np.full(t.size, 0.1))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("beams", "is_there"),
    [
        (SIDE_LOBE_BEAMS[0] - 0.2, False),
        (SIDE_LOBE_BEAMS[0] + 0.1, True),
        (SIDE_LOBE_BEAMS[1] - 0.1, True),
        (SIDE_LOBE_BEAMS[1] + 0.2, False),
    ],
)
@pytest.mark.parametrize("rise", [None, -3.0 * LOW_DB, -1.1 * LOW_DB, -0.9 * LOW_DB, 0.0, 0.9 * LOW_DB, 3.0 * LOW_DB])
def test_a_side_lobe_stands_at_its_distance_and_is_weaker_where_anybody_knows(
    way: tuple[float, float], beams: float, is_there: bool, rise: float | None
) -> None:
    is_weak = rise is None or rise < -LOW_DB
    assert reason_of(beside(beams, way), rise, BEAM_DEG) == (SIDE_LOBE if is_there and is_weak else OFF_PATH)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("share", [-4.0, -1.5, -0.7, 0.0, 0.7, 1.5, 4.0])
def test_another_target_drifts_whichever_way(way: tuple[float, float], share: float) -> None:
    found = reason_of(beside(3.0, way, share * DRIFT_BEAMS_S * BEAM_DEG), 0.0, BEAM_DEG)
    assert (found == WRONG_TARGET) is (abs(share) > 1.0)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("back_s", [0.0, 1.0, 0.9 * RECENT_S, 2.0 * RECENT_S])
def test_a_track_that_drifts_left_the_path_where_its_offset_was_zero_and_not_long_before(
    way: tuple[float, float], back_s: float
) -> None:
    drifts = beside(0.5 * back_s, way, 0.5)
    assert left_path_tai_s(drifts) == pytest.approx(NOW - min(back_s, RECENT_S), abs=0.15)
    assert left_path_tai_s(beside(0.5 * back_s, way, -0.5)) == pytest.approx(NOW, abs=0.15)  # it comes nearer


def test_the_level_rises_by_what_the_newest_are_above_those_kept_and_nobody_knows_it_of_readings_without() -> None:
    def readings(from_s: float, levels_db: list[float] | None) -> Readings:
        count = 2 if levels_db is None else len(levels_db)
        angles = np.zeros(count)
        agc = None if levels_db is None else np.array(levels_db)
        return Readings(NOW + from_s + np.arange(count), angles, angles, agc)

    newest = [20.0] * 10 + [20.5] * 11 + [21.0] * 10  # as many as BEFORE_S holds
    assert len(newest) == BEFORE_S + 1.0 == 3.0 * RECENT_S + 1.0
    kept = readings(-100.0, [90.0] * 60 + newest)
    assert rise_db(kept, readings(0.0, [14.0, 14.0, 14.5])) == pytest.approx(-6.5)
    assert rise_db(readings(0.0, [14.0, 14.0, 14.5]), kept) == pytest.approx(7.0)
    assert rise_db(kept, readings(0.0, None)) is None
    assert rise_db(readings(0.0, None), kept) is None
    assert rise_db(kept, readings(0.0, [np.nan, np.nan])) is None

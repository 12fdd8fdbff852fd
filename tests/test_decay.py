"""Satellites that decay: nothing SGP4 says past the decay is believed, all that is known before it is shown."""

import gzip
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from command_line import acu_daemon
from config_files import STATION, from_file, replaced, write
from conftest import DATA, needs_data
from flights import RISING_TAI_S, climb, demo_target, events_named, sky_of, state_at, the_pass, worst_error_deg
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.daemon.buffer_keeper import LEAST_HORIZON_S
from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction, EarthOrientation
from acu_daemon.orbit.element_set import ElementSet, rad_s_from_rev_day
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DAY_S

# decays within a day by SGP4, which answers again, without an error, from the fourth day on
REENTERING = """1 55897U 22151AAV 25058.12407234  .09435527  24934+0  44853-1 0  9999
2 55897  98.5849 110.9278 0014449 269.2407  90.7207 15.92146194 26688
"""
# eccentric, decays 8.25 days after its epoch; from then on SGP4 says error 6, then error 1
ECCENTRIC = """1 27674U 91075K   18307.19690385  .13489748 -23660-4  84043-3 0  9996
2 27674   7.3667 194.1474 0837473 356.3839   3.0602 14.52109844231405
"""
DECAY_DAYS = 8.25
EQUATOR = replaced(replaced(STATION, "-15.53", "0.0"), "-56.07", "-50.0")


def only_set(text: str) -> ElementSet:
    [one], [] = parse_tle(text, "x.tle")
    return one


def config(directory: Path, text: str, station: str = STATION) -> Path:
    write(directory, station, sat=from_file("X", "tle", "s.tle"))
    (directory / "satellites" / "s.tle").write_text(text)
    return directory


@pytest.mark.parametrize("start", ["2025-03-20T21:39:00Z", "2025-03-03T03:00:00Z", "2025-03-01T00:00:00Z"])
def test_no_pass_is_invented_for_a_satellite_that_has_decayed(tmp_path: Path, start: str) -> None:
    directory = config(tmp_path, REENTERING)
    done = acu_daemon("passes", "--config", directory, "--from", start)
    assert (done.code, done.out) == (2, "")
    assert "the satellite has decayed (SGP4 error 6), from 2025-02-28T02:0" in done.err
    checked = acu_daemon("check", "--config", directory, "--at", start)
    assert checked.code == 1
    assert "NO-GO  sat: elements" in checked.out
    assert "the satellite has decayed" in checked.out
    refused = acu_daemon("run", "--config", directory, "--satellite", "sat", "--at", start)
    assert refused.code == 2
    assert "the satellite has decayed" in refused.err


def test_what_sgp4_says_after_decayed_is_not_believed_in_any_order_of_times() -> None:
    one = only_set(REENTERING)
    source = Sgp4Propagator(one)
    r_m, _ = source.states_teme(one.epoch_tai_s + np.arange(0.0, 0.9 * DAY_S, 60.0))
    assert np.all(np.linalg.norm(r_m, axis=1) < 6700e3)
    for days in (4.0, 10.0, 21.8):  # SGP4: no error, 14 thousand to 24 million km away
        for times in ([0.0, days], [days, 0.0], [days]):
            with pytest.raises(OrbitError, match="has decayed"):
                source.states_teme(one.epoch_tai_s + np.array(times) * DAY_S)
    with pytest.raises(OrbitError, match="not finite"):
        source.states_teme(np.array([np.nan]))


def test_before_the_epoch_an_answer_far_from_the_elements_is_not_believed_either() -> None:
    one = only_set(REENTERING)
    with pytest.raises(OrbitError, match=r"5\.0 days before the epoch of the elements: "):
        Sgp4Propagator(one).states_teme(one.epoch_tai_s - np.array([5.0]) * DAY_S)


def test_a_corrected_source_knows_no_more_than_the_elements() -> None:
    one = only_set(REENTERING)
    fitted = Sgp4Propagator(one).corrected(Correction(delta_mean_anomaly_rad=1e-3))
    with pytest.raises(OrbitError, match="has decayed"):
        fitted.states_teme(one.epoch_tai_s + np.array([5.0]) * DAY_S)


def test_an_orbit_without_an_error_but_far_larger_than_the_elements_is_not_believed() -> None:
    one = only_set(ECCENTRIC)
    with pytest.raises(OrbitError, match="what SGP4 gives is no orbit near that of the elements"):
        Sgp4Propagator(one).states_teme(one.epoch_tai_s - np.array([20.0]) * DAY_S)


@given(
    rev_day=st.floats(15.0, 16.4),
    bstar=st.floats(-0.5, 0.5),
    eccentricity=st.floats(0.0, 0.02),
    days=st.lists(st.floats(0.0, 30.0), min_size=1, max_size=20),
)
def test_whatever_is_answered_is_an_orbit_near_the_elements(
    rev_day: float, bstar: float, eccentricity: float, days: list[float]
) -> None:
    one = replace(
        only_set(REENTERING),
        mean_motion_rad_s=rad_s_from_rev_day(rev_day),
        bstar_per_radius=bstar,
        eccentricity=eccentricity,
    )
    source = Sgp4Propagator(one)
    for day in days:
        try:
            orbit = osculating_from_state(*source.states_teme(np.array([one.epoch_tai_s + day * DAY_S])))
        except OrbitError:
            continue
        assert 0.9 * one.semi_major_axis_m < float(orbit.a_m[0]) < 1.2 * one.semi_major_axis_m


@pytest.mark.long
def test_a_satellite_that_decays_in_days_has_its_passes_until_then(tmp_path: Path) -> None:
    directory = config(tmp_path, ECCENTRIC, EQUATOR)
    asked = ("passes", "--config", directory, "--from", "2018-11-03T05:00:00Z", "--json")
    done = acu_daemon(*asked, "--days", 10)
    assert done.code == 0
    known = acu_daemon(*asked, "--days", 8)
    found, whole = json.loads(done.out), json.loads(known.out)
    assert [one["rise_utc"][:-4] for one in found[: len(whole)]] == [one["rise_utc"][:-4] for one in whole]
    assert len(found) > 40
    decay = only_set(ECCENTRIC).epoch_tai_s + DECAY_DAYS * DAY_S
    assert tai_from_utc(found[-1]["set_utc"]) < decay
    assert tai_from_utc(found[-1]["set_utc"]) > decay - DAY_S
    assert "warning: sat: from 2018-11-11T10:3" in done.err
    assert known.err == ""


def test_a_search_that_begins_before_anything_is_known_says_so(tmp_path: Path) -> None:
    directory = config(tmp_path, ECCENTRIC, EQUATOR)
    done = acu_daemon("passes", "--config", directory, "--from", "2018-10-20T00:00:00Z", "--days", 3)
    assert done.code == 0
    assert "warning: sat: before 2018-10-2" in done.err
    assert acu_daemon("passes", "--config", directory, "--from", "2018-10-10T00:00:00Z").code == 2


def test_two_days_before_the_decay_the_next_pass_is_go_and_the_decay_a_warning(tmp_path: Path) -> None:
    done = acu_daemon("check", "--config", config(tmp_path, ECCENTRIC, EQUATOR), "--at", "2018-11-09T08:00:00Z")
    assert "GO     sat: next pass         2018-11-09T08:44" in done.out
    assert "WARN   sat: decay             from 2018-11-11T10:3" in done.out


def test_a_pass_cut_by_the_decay_is_shown_up_to_it_and_none_after_it(tmp_path: Path) -> None:
    one = only_set(ECCENTRIC)
    [(_, last)] = Sgp4Propagator(one).spans_tai_s
    directory = config(tmp_path, ECCENTRIC)
    lines = (tmp_path / "station.toml").read_text()
    r_m, _ = Sgp4Propagator(one).states_teme(np.array([last]))
    x, y, z = itrs_from_teme(r_m, np.zeros((1, 3)), np.array([last]), EarthOrientation())[0][0]
    below = replaced(lines, "-15.53", f"{np.degrees(np.arctan2(z, np.hypot(x, y))):.3f}")
    (tmp_path / "station.toml").write_text(replaced(below, "-56.07", f"{np.degrees(np.arctan2(y, x)):.3f}"))
    asked = ("passes", "--config", directory, "--json", "--days", 1)
    done = acu_daemon(*asked, "--from", utc_text(last - 0.2 * DAY_S))
    [*_, cut] = json.loads(done.out)
    assert tai_from_utc(cut["set_utc"]) == pytest.approx(last, abs=0.01)
    assert "is cut: what the elements know ends within it" in done.err
    assert LEAST_HORIZON_S < 120.0  # of a buffer, at the end of the span: SGP4 answers so long
    Sgp4Propagator(one).states_teme(np.array([last + 60.0]))
    assert acu_daemon(*asked, "--from", utc_text(last + 300.0)).code == 2


@pytest.mark.long
@needs_data
def test_no_satellite_of_a_real_list_decays_before_its_elements_are_too_old_but_those_about_to() -> None:
    packed = next((DATA / "tle_sets").glob("*.gz"))
    sets, _ = parse_tle(gzip.decompress(packed.read_bytes()).decode(), packed.name)
    ends = [Sgp4Propagator(one).spans_tai_s[0][1] - one.epoch_tai_s for one in sets[::40]]
    assert np.mean(np.array(ends) > 30 * DAY_S) > 0.97


@dataclass(frozen=True)
class Ending:
    """A source that knows nothing after an instant, as SGP4 of a satellite that decays then."""

    source: Propagator
    end_tai_s: float

    kind = "tle"

    @property
    def epoch_tai_s(self) -> float:
        return self.source.epoch_tai_s

    @property
    def spans_tai_s(self) -> tuple[tuple[float, float], ...]:
        return ((-np.inf, self.end_tai_s),)

    def states_teme(self, tai_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if np.any(tai_s > self.end_tai_s + 120.0):
            raise OrbitError("the satellite has decayed")
        return self.source.states_teme(tai_s)

    def corrected(self, correction: Correction) -> "Ending":
        return Ending(self.source.corrected(correction), self.end_tai_s)


@pytest.mark.long
def test_a_pass_that_the_decay_cuts_is_tracked_on_the_prediction_up_to_it() -> None:
    target, known_s = demo_target(), 70.0
    end_tai_s = RISING_TAI_S + known_s
    elements = replace(target.elements, propagator=Ending(target.elements.propagator, end_tai_s))
    cut = replace(target, elements=elements)
    assert the_pass(cut, RISING_TAI_S).set_tai_s == end_tai_s
    flight = climb(known_s + 60.0, cut, losses=[(30.0, 200.0)], sky=sky_of(target))
    assert state_at(flight, end_tai_s - 0.5) == "HOLD/FITTED"
    assert worst_error_deg(flight, RISING_TAI_S + 30.0, end_tai_s - 0.5) < 0.1
    assert not events_named(flight, "fit.failed")
    assert not events_named(flight, "prediction.failed")
    assert flight.outcome.reason == "pass over"

"""P4: what a run left is gone on from by the same station, estimator, satellite, elements, pass and clock alone.

Every part of whose it is changes alone; and so does what the last pass left to the next one.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from config_files import BROUWER, STATION, replaced, write
from memories import remembering
from structlog.testing import capture_logs

from acu_daemon.assist.estimators.estimator import ESTIMATORS
from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.cli.kept import Kept, open_kept
from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.config.to_settings import estimator_settings
from acu_daemon.control.state import ByHand, ControlState, Nudge
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.writer import Writer
from acu_daemon.model import FitResult, Model, Readings
from acu_daemon.orbit.timescales import tai_from_utc

NEAR_TAI_S = tai_from_utc("1989-01-31T15:00:00Z")
OTHERS = {
    "latitude": ("latitude_deg = -15.53", "latitude_deg = -15.531"),
    "longitude": ("longitude_deg = -56.07", "longitude_deg = -56.071"),
    "height": ("height_m = 277.0", "height_m = 280.0"),
}
ELEMENTS = {
    "epoch": ("epoch_utc = 1989-01-31T09:58:00Z", "epoch_utc = 1989-01-31T09:58:01Z"),
    "semi-major axis": ("semi_major_axis_km = 7180.0", "semi_major_axis_km = 7180.01"),
    "eccentricity": ("eccentricity = 0.0436", "eccentricity = 0.04361"),
    "inclination": ("inclination_deg = 23.82", "inclination_deg = 23.821"),
    "node": ("raan_deg = 240.14", "raan_deg = 240.141"),
    "perigee": ("arg_perigee_deg = 15.47", "arg_perigee_deg = 15.471"),
    "mean anomaly": ("mean_anomaly_deg = 350.56", "mean_anomaly_deg = 350.561"),
}
BY_HAND = ByHand(is_held=True, nudge=Nudge(0.2, -0.1, Model.NEW_FIT))
NAME = ('name = "SCD-1"', 'name = "SCD-2"')


class Place:
    """A configuration and a state directory, and a clock in mid-pass."""

    def __init__(self, directory: Path, estimator: str = "full") -> None:
        self.directory, self.state = directory, directory / "state"
        self.state.mkdir()
        self.configure(estimator=estimator)
        self.coming = coming_pass(self.target, NEAR_TAI_S)
        self.clock = SystemClock(self.coming.rise_tai_s + 120.0)

    def configure(self, station: str = STATION, satellite: str = BROUWER, estimator: str = "full") -> None:
        write(self.directory, f'{station}[tracking]\nestimator = "{estimator}"\n', scd=satellite)
        self.target = load_target(self.directory, "scd", NEAR_TAI_S)

    def opened(self) -> tuple[Kept, Writer]:
        files = Writer("files")
        return open_kept(self.state, self.target, self.coming, self.clock, files), files

    def fit(self) -> FitResult:
        """To the first minute of the pass, without noise."""
        target = self.target
        tai_s = self.coming.rise_tai_s + np.arange(30.0, 90.0)
        seen = encoder_look(target.elements.propagator, tai_s, target.station.site, None)
        settings = estimator_settings(target.station, target.satellite)
        name = target.station.tracking.estimator
        estimator = ESTIMATORS[name](target.elements.propagator, target.station.site, settings)
        estimator.add(Readings(tai_s, seen.az_deg % 360.0, seen.el_deg))
        fit = estimator.fit()
        assert fit is not None
        return fit

    def leave(self) -> None:
        """Track for a while, and end."""
        kept, files = self.opened()
        kept.see(remembering(track=TrackState.AUTOTRACK_FITTED, by_people=True))
        kept.offer(self.fit())
        kept.see(remembering(track=TrackState.HOLD_FITTED, by_people=True, by_hand=BY_HAND))
        kept.flush()
        assert files.close(60.0)

    def gone_on_from(self) -> tuple[CarryOver | None, ControlState, list[str]]:
        """What the next start begins with, and what it says of it."""
        with capture_logs() as log:
            kept, files = self.opened()
        assert files.close(60.0)
        return kept.carried, kept.state, [str(entry["event"]) for entry in log]


@pytest.mark.parametrize("estimator", sorted(ESTIMATORS))
def test_the_same_run_is_gone_on_from_with_its_fit_and_its_memory(tmp_path: Path, estimator: str) -> None:
    place = Place(tmp_path, estimator)
    place.leave()
    carried, state, said = place.gone_on_from()
    assert carried is not None
    assert carried.is_of_this_pass
    assert carried.estimator == estimator
    assert state.arming.by_people is True
    assert state.by_hand == BY_HAND
    assert "run.resumed" in said


@pytest.mark.long
@pytest.mark.parametrize("before", sorted(ESTIMATORS))
@pytest.mark.parametrize("after", sorted(ESTIMATORS))
def test_the_fit_of_another_estimator_is_not_gone_on_from(tmp_path: Path, before: str, after: str) -> None:
    place = Place(tmp_path, before)
    place.leave()
    place.configure(estimator=after)
    carried, state, said = place.gone_on_from()
    assert ("run.resumed" in said) is (before == after)
    assert ("run_state.dropped" in said) is (before != after)
    assert carried is None or carried.is_of_this_pass is (before == after)
    assert state.arming.by_people is True  # it is the same pass of the same antenna all the same


@pytest.mark.parametrize("part", sorted(OTHERS))
def test_the_fit_of_another_station_is_not_gone_on_from_and_leaves_the_orbit_alone(tmp_path: Path, part: str) -> None:
    place = Place(tmp_path)
    place.leave()
    place.configure(station=replaced(STATION, *OTHERS[part]))
    carried, _, said = place.gone_on_from()
    assert "run_state.dropped" in said
    assert "run.resumed" not in said
    assert carried is not None  # the next best: what a pass leaves to the next one
    assert not carried.is_of_this_pass
    assert carried.station != place.target.station.site.station


@pytest.mark.parametrize("part", sorted(ELEMENTS))
def test_a_fit_to_other_elements_is_used_by_nobody(tmp_path: Path, part: str) -> None:
    place = Place(tmp_path)
    place.leave()
    place.configure(satellite=replaced(BROUWER, *ELEMENTS[part]))
    carried, state, said = place.gone_on_from()
    assert carried is None
    assert {"run_state.dropped", "carry_over.dropped"} <= set(said)
    assert state.by_hand == (ByHand(is_held=True) if part == "epoch" else BY_HAND)


def test_another_satellite_takes_neither_the_fit_nor_the_memory(tmp_path: Path) -> None:
    place = Place(tmp_path)
    place.leave()
    place.configure(satellite=replaced(BROUWER, *NAME))
    carried, state, said = place.gone_on_from()
    assert (carried, state.arming.by_people, state.by_hand) == (None, None, ByHand())
    assert "run.resumed" not in said


def later_pass(place: Place) -> None:
    place.coming = coming_pass(place.target, place.coming.set_tai_s + 600.0)


def another_rehearsal(place: Place) -> None:
    place.clock = SystemClock(place.clock.tai_s() + 60.0)


@pytest.mark.parametrize("change", [later_pass, another_rehearsal], ids=lambda one: one.__name__)
def test_another_pass_or_rehearsal_takes_only_what_a_pass_leaves_to_the_next(
    tmp_path: Path, change: Callable[[Place], None]
) -> None:
    place = Place(tmp_path)
    place.leave()
    change(place)
    carried, state, said = place.gone_on_from()
    assert "run.resumed" not in said
    assert "carry_over.used" in said
    assert carried is not None
    assert not carried.is_of_this_pass
    assert (state.arming.by_people, state.by_hand) == (None, ByHand())

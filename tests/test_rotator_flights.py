"""Passes by program track on a simulated rotator behind rotctld: followed; troubles are told, and it goes on."""

import math
from dataclasses import dataclass
from pathlib import Path

import config_files
import numpy as np
import pytest
from command_line import acu_daemon
from conftest import DATA
from driver_benches import TaggedOnBench
from rotators import Habits, Rotator, RotatorFlight, fly_rotator
from tagged_driver import TaggedDriver

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.cli.options import Target, coming_pass, load_target
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.edge.tape_file import SUFFIX
from acu_daemon.errors import UsageError
from acu_daemon.model import sky_angle_deg
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.scenario import Scenario, SkyErrors
from acu_daemon.sim.sky import SimulatedSky
from acu_daemon.units import wrap_180

pytestmark = pytest.mark.long

NOAA_20 = """
[satellite]
name = "NOAA 20"
norad_id = 43013
[elements]
kind = "tle"
file = "noaa20.tle"
"""
STATION = (
    config_files.STATION.replace('url = "tcp://127.0.0.1:3842"', 'url = "tcp://127.0.0.1:4533"\ndialect = "rotctl"')
    .replace(
        "min_deg = -270.0\nmax_deg = 270.0\nmax_rate_deg_s = 20.0",
        "min_deg = -180\nmax_deg = 450\nmax_rate_deg_s = 6.0",
    )
    .replace("max_acceleration_deg_s2 = 10.0", "max_acceleration_deg_s2 = 6.0")
    .replace("max_rate_deg_s = 5.0", "max_rate_deg_s = 3.0")
    + "[receiver]\nbeamwidth_deg = 10.0\n"
)
DEAD_BAND_DEG = 0.5
FROM_UTC = "2026-05-30T18:00:00Z"
needs_sets = pytest.mark.skipif(not (DATA / "tle_sets").is_dir(), reason="needs ../shared/data/tle_sets")


def brouwer(folder: Path, station: str = STATION) -> Target:
    """SCD-1 of the 1990 paper, for flights that need no real element set."""
    return load_target(config_files.write(folder, station), "scd", tai_from_utc("1989-02-01T01:40:00Z"))


def mid_pass(target: Target) -> float:
    coming = coming_pass(target, tai_from_utc("1989-02-01T01:40:00Z"))
    return coming.rise_tai_s + 0.3 * coming.duration_s


def off_deg(flight: RotatorFlight, target: Target, from_tai_s: float, to_tai_s: float) -> np.ndarray:
    """Angle between the rotator and the satellite by its elements, on the sky."""
    rows = [row for row in flight.places if from_tai_s <= row[0] <= to_tai_s]
    look = encoder_look(target.elements.propagator, np.array([row[0] for row in rows]), target.station.site, None)
    pairs = zip(rows, look.az_deg.tolist(), look.el_deg.tolist(), strict=True)
    return np.array([sky_angle_deg(az, el, path_az, path_el) for (_, az, el), path_az, path_el in pairs])


@needs_sets
def test_p2_a_whole_pass_of_a_real_element_set_is_followed_within_the_dead_band(tmp_path: Path) -> None:
    sets = (DATA / "tle_sets" / "celestrak_weather_2026-05-30.txt").read_text().splitlines()
    first = next(i for i, line in enumerate(sets) if line.startswith("1 43013"))
    config = config_files.write(tmp_path, STATION, noaa20=NOAA_20)
    (config / "satellites" / "noaa20.tle").write_text("\n".join(sets[first : first + 2]) + "\n")
    target = load_target(config, "noaa20", tai_from_utc(FROM_UTC))
    coming = coming_pass(target, tai_from_utc(FROM_UTC))
    rotator = Rotator(place=[0.0, 0.0])
    flight = fly_rotator(target, rotator, coming.rise_tai_s - 100.0, coming.set_tai_s + 30.0)
    assert flight.states() == ["IDLE", "PREPOSITION", "PROGRAM", "IDLE"]
    assert flight.outcome is not None
    assert (flight.outcome.reason, flight.outcome.is_stopped, flight.outcome.refusal_count) == ("pass over", True, 0)
    off = off_deg(flight, target, coming.rise_tai_s, coming.set_tai_s)
    assert off.size > 3000
    assert off.max() < DEAD_BAND_DEG
    in_pass = [order for order in rotator.orders if order[1].startswith("P")]
    way_deg = _way_deg(target, coming.rise_tai_s, coming.set_tai_s)
    assert len(in_pass) < 1.2 * way_deg / DEAD_BAND_DEG + 2.0 * 360.0 / DEAD_BAND_DEG
    assert rotator.orders[-1][1] == "S"
    assert flight.to_fit_count == 0
    assert {seen.verdict for seen in flight.snapshots[-1500:-500]} == {"PROGRAM TRACK"}
    assert not any(seen.is_acquired for seen in flight.snapshots)


def _way_deg(target: Target, from_tai_s: float, to_tai_s: float) -> float:
    """How far both axes go in a pass."""
    look = encoder_look(target.elements.propagator, np.arange(from_tai_s, to_tai_s, 1.0), target.station.site, None)
    az_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    return float(np.abs(np.diff(az_deg)).sum() + np.abs(np.diff(look.el_deg)).sum())


@pytest.mark.parametrize(
    "habits",
    [Habits(latency_s=0.35), Habits(piece_bytes=1, latency_s=0.001), Habits(piece_bytes=4)],
    ids=["slow", "byte by byte", "split"],
)
def test_p2_a_rotctld_that_is_slow_or_splits_its_answers_is_followed_without_an_alarm(
    tmp_path: Path, habits: Habits
) -> None:
    target = brouwer(tmp_path)
    begin = mid_pass(target)
    path = encoder_look(target.elements.propagator, np.array([begin]), target.station.site, None)
    rotator = Rotator(place=[float(path.az_deg[0]), float(path.el_deg[0])])
    tape = tmp_path / f"rotator{SUFFIX}"
    flight = fly_rotator(target, rotator, begin, begin + 60.0, habits=habits, tape=tape)
    assert replay_pass(tape).difference is None
    assert flight.states()[:3] == ["IDLE", "PREPOSITION", "PROGRAM"]
    assert flight.named("link.lost") == []
    assert off_deg(flight, target, begin + 20.0, begin + 60.0).max() < 2.0 * DEAD_BAND_DEG
    assert flight.outcome is not None
    assert (flight.outcome.skipped_tick_count, flight.outcome.connect_count) == (0, 1)
    assert flight.outcome.tick_count > 60.0 / 1.0


def test_p3_a_rotator_that_stops_answering_its_rotctld_is_told_and_the_pass_goes_on_when_it_does_again(
    tmp_path: Path,
) -> None:
    target = brouwer(tmp_path)
    begin = mid_pass(target)
    habits = Habits()
    script = [
        (20.0, lambda _l, h, _s: h.refuses.update({"p": 6, "P": 6})),
        (35.0, lambda _l, h, _s: h.refuses.clear()),
    ]
    flight = fly_rotator(target, Rotator(place=[200.0, 30.0]), begin, begin + 80.0, habits=habits, script=script)
    assert "LINK-LOST" in flight.states()
    assert any("IO error" in str(event["reason"]) for event in flight.named("link.lost"))
    assert flight.states()[-1] == "PROGRAM"
    assert off_deg(flight, target, begin + 75.0, begin + 80.0).max() < 2.0 * DEAD_BAND_DEG


def test_p3_a_refused_angle_is_told_and_sent_again(tmp_path: Path) -> None:
    target = brouwer(tmp_path)
    begin = mid_pass(target)
    script = [
        (30.0, lambda _l, h, _s: h.refuses.update({"P": 9})),
        (40.0, lambda _l, h, _s: h.refuses.clear()),
    ]
    flight = fly_rotator(target, Rotator(place=[200.0, 30.0]), begin, begin + 80.0, script=script)
    assert any("command rejected" in event["reason"] for event in flight.named("acu.nak"))
    assert flight.named("link.lost") == []
    assert off_deg(flight, target, begin + 75.0, begin + 80.0).max() < 2.0 * DEAD_BAND_DEG


def test_p3_a_dying_rotctld_is_told_and_the_pass_goes_on_when_it_is_back(tmp_path: Path) -> None:
    target = brouwer(tmp_path)
    begin = mid_pass(target)
    script = [(25.0, lambda link, _h, _s: link.die()), (40.0, lambda _l, h, _s: setattr(h, "is_dead", False))]
    flight = fly_rotator(target, Rotator(place=[200.0, 30.0]), begin, begin + 80.0, script=script)
    assert flight.named("link.lost")
    assert flight.outcome is not None
    assert flight.outcome.connect_count == 2
    assert flight.states()[-1] == "PROGRAM"
    assert off_deg(flight, target, begin + 75.0, begin + 80.0).max() < 2.0 * DEAD_BAND_DEG


def test_p5_an_axis_that_stands_still_is_stopped_and_latched(tmp_path: Path) -> None:
    target = brouwer(tmp_path)
    begin = mid_pass(target)
    rotator = Rotator(place=[200.0, 30.0])
    script = [(25.0, lambda _l, _h, _s: setattr(rotator, "rate_deg_s", (6.0, 0.0)))]
    flight = fly_rotator(target, rotator, begin, begin + 60.0, script=script)
    assert [event["problem"] for event in flight.named("axis.latched")] == [
        "elevation stands still away from its command"
    ]
    latched = next(i for i, order in enumerate(rotator.orders) if order[1] == "S")
    assert all(order[1] == "S" for order in rotator.orders[latched:])


@dataclass
class TaggedUnderTheSky(Rotator):
    """The imaginary ACU of tagged_driver, which hears a satellite within 2 deg of where it points, but in a loss."""

    sky: SimulatedSky | None = None
    begin_tai_s: float = 0.0
    lost_s: tuple[float, float] = (60.0, 90.0)

    def __post_init__(self) -> None:
        axes = Rotator((20.0, 5.0), 0.001, 0.0, place=self.place)
        self.acu = TaggedOnBench(axes)

    def advance(self, now_s: float) -> None:
        assert self.sky is not None
        at = self.sky.direction(self.begin_tai_s + now_s)
        az_deg, el_deg = self.acu.place(now_s)
        self.place[:] = az_deg, el_deg
        is_lost = self.lost_s[0] <= now_s < self.lost_s[1]
        is_near = at is not None and sky_angle_deg(az_deg, el_deg, at[0], at[1]) < 2.0
        self.acu.hears(is_near and not is_lost)
        if at is not None:
            self.acu.source_deg = az_deg + wrap_180(at[0] - az_deg), at[1]

    def answer(self, line: str, now_s: float) -> str:
        self.advance(now_s)
        return self.acu.said(line, now_s) + "\n"


def test_p2_another_acu_with_autotrack_is_tracked_fitted_and_led_through_a_loss(tmp_path: Path) -> None:
    """One that was written from docs/adding-an-acu.md alone: no watchdog, no read-back, bearings, tagged lines."""
    target = brouwer(tmp_path, config_files.STATION.replace("-270.0", "-180.0").replace("270.0", "180.0"))
    begin = mid_pass(target)
    path = encoder_look(target.elements.propagator, np.array([begin]), target.station.site, None)
    sky = make_sky(target.elements.propagator, target.station.site, Scenario(sky=SkyErrors(along_track_s=1.0)))
    place = [wrap_180(float(path.az_deg[0])), float(path.el_deg[0])]
    acu = TaggedUnderTheSky(place=place, sky=sky, begin_tai_s=begin)
    flight = fly_rotator(target, acu, begin, begin + 110.0, driver=TaggedDriver())
    assert flight.states()[-3:] == ["AUTOTRACK/FITTED", "HOLD/FITTED", "AUTOTRACK/FITTED"]
    assert flight.outcome is not None
    assert flight.outcome.has_acquired
    assert flight.outcome.is_stopped
    assert flight.outcome.refit_count > 10
    assert flight.outcome.refusal_count == 0
    lost = [seen for seen in flight.snapshots if seen.state == "HOLD/FITTED"]
    assert len(lost) > 250
    assert {seen.acu_mode for seen in lost[5:]} == {"REMOTE_BACKUP"}
    assert max(seen.off_path_deg or 0.0 for seen in lost[20:]) < 0.2
    assert flight.named("acu.watchdog_refused") == []


def test_limits_that_the_rotator_does_not_reach_end_the_run_and_say_what_to_do(tmp_path: Path) -> None:
    target = brouwer(tmp_path)
    begin = mid_pass(target)
    rotator = Rotator(az_limits_deg=(0.0, 360.0))
    with pytest.raises(UsageError, match=r"\[acu.azimuth\] is -180 to 450 deg, the ACU goes from 0 to 360"):
        fly_rotator(target, rotator, begin, begin + 10.0)
    assert rotator.orders == [] or rotator.orders[-1][1] == "S"


def test_a_rehearsal_runs_on_no_real_rotator(tmp_path: Path) -> None:
    target = brouwer(tmp_path)
    begin = mid_pass(target)
    rotator = Rotator(model=603)
    with pytest.raises(UsageError, match="the ACU is a real one"):
        fly_rotator(target, rotator, begin, begin + 10.0)
    assert [order for order in rotator.orders if order[1].startswith("P")] == []
    assert math.isclose(rotator.place[0], 0.0)


def test_the_simulated_acu_is_none_for_a_rotator_and_says_what_is(tmp_path: Path) -> None:
    done = acu_daemon("fake-acu", "--config", config_files.write(tmp_path, STATION), "--satellite", "scd")
    assert done.code == 2
    assert "rotctld -m 1" in done.err

"""The plan of one pass in words and as data: every figure of it, each in its own place and with its sign."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from acu_daemon.cli.pass_plan_command import _crossing_data, _data, _lines, _Planned
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.approach import ACQUIRE_LEAD_S, BEGIN_S, way_s
from acu_daemon.control.tracking.expected_way import ExpectedWay
from acu_daemon.model import AxisLimits, Pass, ZenithCrossing
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.reach import OutOfReach
from acu_daemon.pointing.tilt import Tilt
from acu_daemon.pointing.turn_plan import Unwinding

RISE = tai_from_utc("2026-03-01T12:00:00Z")
AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 5.0, 2.0), AxisLimits(0.0, 90.0, 2.0, 1.0)
COMING = Pass(RISE, RISE + 300.0, RISE + 600.0, 350.0, 67.8912, 20.0, 100.0)
CROSSING = ZenithCrossing(RISE + 290.0, RISE + 310.0, 350.0, 1.0, 9.0, 1.234, 4.56, RISE + 295.0)


def planned(
    start_az_deg: float = -10.0,
    present_deg: tuple[float, float] = (30.0, 0.0),
    preposition_s: float = 5.0,
    start_tai_s: float = RISE,
    tilt: Tilt | None = None,
    step_s: float = 0.25,
    **plan: Any,
) -> _Planned:
    station: Any = SimpleNamespace(
        station=SimpleNamespace(name="Cuiaba"),
        site=None,
        receiver=SimpleNamespace(beamwidth_deg=1.5),
        tracking=SimpleNamespace(preposition_s=preposition_s),
        bounds=SimpleNamespace(azimuth=AZIMUTH, elevation=ELEVATION, sun=None, keep_outs=()),
    )
    target: Any = SimpleNamespace(elements=SimpleNamespace(label="SCD (22490)", propagator=None), station=station)
    count = round(4.0 / step_s) + 1
    tai_s = start_tai_s + step_s * np.arange(count)
    az_deg = start_az_deg + 5.0 * np.arange(count)
    off_deg = np.where(np.arange(count) < 3, 0.8, 0.1)
    way = ExpectedWay(tai_s, az_deg, np.arange(count) + 0.5, az_deg + 0.25, np.arange(count) + 0.75, off_deg)
    passing = PassPlan(RISE, RISE + 600.0, start_tai_s, start_az_deg, 5.25, **plan)
    return _Planned(target, COMING, passing, way, present_deg, tilt)


def lines(of: _Planned) -> dict[str, str]:
    head, *rest = _lines(of)
    assert head == "SCD (22490) over Cuiaba"
    return {one[:10].rstrip(): one[11:] for one in rest}


def test_a_plain_pass_has_a_head_and_four_lines() -> None:
    of = planned()
    said = lines(of)
    assert list(said) == ["pass", "turn", "way there", "expected"]
    assert said["pass"] == "2026-03-01T12:00:00Z to 2026-03-01T12:10:00Z, up to 67.89 deg"
    assert said["turn"] == "azimuth -10.00 to 70.25 deg (+80.2), holds the whole pass"
    assert said["way there"].startswith("-40.0 deg of azimuth from 30; the antenna sets out 2026-03-01T11:59:")
    assert said["expected"] == "at most 0.80 deg off, 0.8 s out of half a beam (0.75 deg)"


def test_what_is_not_plain_stands_between_the_way_and_what_is_expected() -> None:
    beyond = OutOfReach("azimuth", RISE + 10.0, RISE + 20.0, "azimuth is too slow")
    of = planned(
        tilt=Tilt(-6.0, 90.0), note="no turn holds it", unwindings=(Unwinding(RISE + 100.0, -360.0, 75.2),),
        crossing=CROSSING, beyond=(beyond,),
    )  # fmt: skip
    said = lines(of)
    assert list(said) == ["pass", "turn", "way there", "tilt", "unwinding", "zenith", "azimuth", "expected"]
    assert said["turn"].endswith(", no turn holds it")
    assert said["tilt"] == "-6.0 deg towards 90 deg"
    assert said["unwinding"] == "-360 deg from 2026-03-01T12:01:40Z on, 75 s"
    assert said["zenith"].endswith("out of the beam for 4.6 s from 2026-03-01T12:04:55Z on")
    assert said["azimuth"] == str(beyond)
    for turn in (1, -1):
        assert lines(planned(crossing=CROSSING, zenith_turn=turn))["zenith"].endswith("because of the stops")


@pytest.mark.parametrize(("after_s", "said"), [(0.4, "0 s after the rise"), (42.0, "42 s after the rise")])
def test_a_pass_in_progress_is_joined_after_its_rise(after_s: float, said: str) -> None:
    assert lines(planned(start_tai_s=RISE + after_s))["way there"] == f"-40.0 deg of azimuth from 30; {said}"


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_antenna_sets_out_as_early_as_the_slower_axis_needs_or_as_it_is_said(sign: float) -> None:
    by_azimuth = planned(start_az_deg=30.0 + sign * 200.0)
    assert by_azimuth.lead_s == pytest.approx(BEGIN_S + way_s(200.0, AZIMUTH) + ACQUIRE_LEAD_S)
    by_elevation = planned(start_az_deg=30.0, present_deg=(30.0, 5.25 + sign * 80.0))
    assert by_elevation.lead_s == pytest.approx(BEGIN_S + way_s(80.0, ELEVATION) + ACQUIRE_LEAD_S)
    assert planned(preposition_s=500.0).lead_s == 500.0
    assert planned(preposition_s=60.0).half_beam_deg == 0.75
    said = lines(planned(preposition_s=90.0))["way there"]
    assert said.endswith("the antenna sets out 2026-03-01T11:58:30Z")


def test_the_data_have_every_figure_under_its_name() -> None:
    of = planned(
        preposition_s=90.0, note="so", unwindings=(Unwinding(RISE + 100.0, -360.0, 75.25),), tilt=Tilt(2.5, 9.0)
    )
    found = _data(of)
    path = found.pop("path")
    assert found == {
        "satellite": "SCD (22490)",
        "station": "Cuiaba",
        "rise_utc": "2026-03-01T12:00:00.000Z",
        "set_utc": "2026-03-01T12:10:00.000Z",
        "culmination_deg": 67.8912,
        "start_utc": "2026-03-01T12:00:00.000Z",
        "start_az_deg": -10.0,
        "start_el_deg": 5.25,
        "lead_s": 90.0,
        "tilt_deg": 2.5,
        "note": "so",
        "unwindings": [{"utc": "2026-03-01T12:01:40.0Z", "by_deg": -360.0, "for_s": 75.2}],
        "zenith": None,
        "beyond": [],
        "largest_error_deg": 0.8,
        "out_of_beam_s": 0.8,
    }
    assert [one["utc"] for one in path] == [f"2026-03-01T12:00:0{k}.0Z" for k in range(5)]
    assert path[1] == {
        "utc": "2026-03-01T12:00:01.0Z", "path_az_deg": 10.0, "path_el_deg": 4.5,
        "antenna_az_deg": 10.25, "antenna_el_deg": 4.75, "off_deg": 0.1,
    }  # fmt: skip
    assert path[0]["off_deg"] == 0.8


@pytest.mark.parametrize(("step_s", "count"), [(0.5, 5), (1.0, 5), (2.0, 3)])
def test_the_path_has_a_row_a_second_or_as_many_as_there_are(step_s: float, count: int) -> None:
    assert len(_data(planned(step_s=step_s))["path"]) == count


def test_a_crossing_has_its_times_as_utc_and_none_where_the_beam_holds() -> None:
    found = _crossing_data(CROSSING)
    assert found == {
        "departure_utc": "2026-03-01T12:04:50.00Z",
        "return_utc": "2026-03-01T12:05:10.00Z",
        "departure_az_deg": 350.0,
        "departure_rate_deg_s": 1.0,
        "peak_rate_deg_s": 9.0,
        "largest_error_deg": 1.234,
        "lost_s": 4.56,
        "lost_from_utc": "2026-03-01T12:04:55.00Z",
        "is_plunge": False,
    }
    held = ZenithCrossing(RISE, RISE + 9.0, 1.0, 2.0, 3.0, 0.1, 0.0, None)
    assert _crossing_data(held)["lost_from_utc"] is None
    assert _data(planned(crossing=held))["zenith"] == _crossing_data(held)

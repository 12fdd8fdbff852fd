"""The phantom pass: what limits, stops, zenith, keep-outs and mask cost, found before the pass."""

from dataclasses import replace
from pathlib import Path

import pytest
from flights import DEMO_TAI_S, demo_target, the_pass
from test_station import START, Night, night
from test_station_stow import says

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.options import Target
from acu_daemon.config.to_settings import control_config, driver_of, keyhole_rules
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.phantom import PhantomPass, fly_phantom
from acu_daemon.edge.hooks import Hook
from acu_daemon.pointing.keep_out import KeepOut
from acu_daemon.schedule.book import PassState

BEFORE_TAI_S = DEMO_TAI_S - 900.0


def config_of(target: Target) -> ControlConfig:
    return control_config(target.station, target.satellite, driver_of(target.station), 0.0)


def flown(target: Target, **changes: object) -> PhantomPass:
    """The demo's pass up to shortly after its culmination, 0.2 deg from the zenith."""
    coming = the_pass(target, BEFORE_TAI_S)
    coming = replace(coming, rise_tai_s=DEMO_TAI_S - 60.0, set_tai_s=DEMO_TAI_S + 120.0)
    config: ControlConfig = replace(
        control_config(target.station, target.satellite, driver_of(target.station), 0.0), **changes
    )
    source, site = target.elements.propagator, target.station.site
    return fly_phantom(source, site, coming, config, keyhole_rules(target.station), (100.0, 45.0))


@pytest.mark.long
def test_a_pass_over_the_zenith_costs_what_its_plan_says_and_nothing_else() -> None:
    found = flown(demo_target())
    assert found.up_s == pytest.approx(180.0, abs=0.2)
    assert {one.why for one in found.lost} == {"the azimuth drive cannot follow over the zenith"}
    assert found.up_s - found.on_path_s == pytest.approx(5.7, abs=0.3)
    [told] = found.told
    assert "out of the beam for 5.7 s" in told
    assert (found.no_go, found.kept_back) == ("", ())


def test_where_no_turn_has_the_bearing_it_is_a_no_go_with_its_reason() -> None:
    found = flown(demo_target(azimuth={"min_deg": 0.0, "max_deg": 100.0}))
    assert found.on_path_s < 6.0
    assert any("azimuth outside 0 to 100 deg" in one.why for one in found.lost)
    never = replace(found, on_path_s=0.0)
    assert never.no_go.startswith("phantom pass: the antenna is never on the path")


def test_a_keep_out_on_the_path_is_gone_around_and_its_cost_told() -> None:
    envelope = replace(config_of(demo_target()).envelope, keep_outs=(KeepOut("mast", 150.0, 180.0, 60.0, 70.0),))
    found = flown(demo_target(), envelope=envelope)
    assert any("keep-out" in one.why or "mast" in one.why for one in found.lost)
    assert any("mast" in one for one in found.told)
    assert found.record["words"] == str(found)


# In the station


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> tuple[Night, list[str], list[dict[str, object]]]:
    answers: list[str] = []
    told: list[dict[str, object]] = []

    def listen(access) -> None:  # type: ignore[no-untyped-def]
        hooks = access.runs.day.hooks
        hooks.call = lambda hook, about: told.append(dict(about)) if hook is Hook.AFTER_PASS else None

    script = [(START + 1.0, listen), (START + 100.0, says("status", answers)), (START + 225.0, says("skip", answers))]
    return night(tmp_path_factory.mktemp("short"), minutes=4.0, script=script, has_phantom=True), answers, told


@pytest.mark.long
def test_what_it_finds_is_in_the_log_the_status_and_what_the_report_is_made_from(short) -> None:  # type: ignore[no-untyped-def]
    found, answers, told = short
    [flown] = found.days.named("phantom.flown")
    assert flown["what"].startswith("on the path for 123 of 123 s")
    assert f'"phantom": "{flown["what"]}"' in answers[0]
    assert told[0]["phantom"]["words"] == flown["what"]  # type: ignore[index]
    assert told[0]["hooks"] == []


def test_a_pass_of_which_nothing_can_be_tracked_is_not_begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    never = PhantomPass(up_s=123.0, on_path_s=0.0, largest_off_deg=0.0)
    monkeypatch.setattr("acu_daemon.cli.phantom_check.fly_phantom", lambda *_: never)
    found = night(tmp_path, minutes=5.0, has_phantom=True)
    assert found.of("scd").state is PassState.FAILED
    assert found.of("scd").reason.startswith("not begun: phantom pass: the antenna is never on the path")
    assert {row.mode for row in found.days.rows} == {AcuMode.STANDBY}

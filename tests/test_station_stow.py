"""The station's stow: by the wind, in a pass and at rest, through kills; by a person."""

from pathlib import Path

import pytest
from test_station import START, Night, configured, night

from acu_daemon.acu.commands import STOW_MODES, AcuMode
from acu_daemon.cli.virtual_station import Action, KilledError, StationAccess, run_days
from acu_daemon.edge.latch import STOWED
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import PassState

CALM, STRONG = (3.0, 5.0), (12.0, 20.0)
RISE = START + 206.0  # of the pass, about
QUICK = "max_age_s = 600\nresume_after_s = 20\n"


def blows(directory: Path, wind: tuple[float, float]) -> Action:
    def action(access: StationAccess) -> None:
        utc = utc_text(access.runs._setup.clock.tai_s())
        said = f'{{"mean_m_s": {wind[0]}, "gust_m_s": {wind[1]}, "utc": "{utc}"}}'
        (directory / "wind.json").write_text(said)

    return action


def watched(directory: Path, more: str = QUICK) -> str:
    return f'[wind]\nfile = "{directory}/wind.json"\n{more}'


def modes(found: Night, from_tai_s: float, to_tai_s: float) -> set[AcuMode]:
    return {row.mode for row in found.days.rows if from_tai_s < row.tai_s < to_tai_s}


def says(line: str, answers: list[str]) -> Action:
    return lambda access: answers.append(access.runs.answer(line, "a person"))


@pytest.mark.long
def test_wind_in_mid_pass_stows_and_the_pass_goes_on_once_it_is_calm_again(tmp_path: Path) -> None:
    script = [
        (START, blows(tmp_path, CALM)),
        (RISE + 15.0, blows(tmp_path, STRONG)),
        (RISE + 25.0, blows(tmp_path, CALM)),
    ]
    found = night(tmp_path, watched(tmp_path), minutes=4.8, script=script)
    assert modes(found, RISE + 18.0, RISE + 44.0) <= set(STOW_MODES)
    assert AcuMode.AUTOTRACK in modes(found, RISE + 60.0, RISE + 82.0)
    assert "stowed by the wind" in found.of("scd").reason
    assert [one["was_by"] for one in found.days.named("stow.ends")] == ["wind"]


def test_a_kill_while_stowed_for_the_wind_forgets_neither_the_stow_nor_how_calm_it_must_become(tmp_path: Path) -> None:
    def kill(_access: StationAccess) -> None:
        raise KilledError

    config, state = configured(tmp_path / "config", watched(tmp_path, "max_age_s = 600\n")), tmp_path / "state"
    state.mkdir()
    begin = [(START, blows(tmp_path, STRONG)), (START + 60.0, kill)]
    killed = run_days(config, state, START, START + 70.0, script=begin)
    assert (state / STOWED).read_text().startswith("wind\n")
    breeze = (10.0, 12.0)  # below the limits, above what they must fall to
    script = [(START + 65.5, blows(tmp_path, breeze))]
    days = run_days(config, state, START + 65.0, START + 360.0, script=script, before=killed)
    assert {row.mode for row in days.rows} <= set(STOW_MODES)
    with ScheduleFile(state, is_read_only=True) as file:
        [scd] = [one for one in file.book(START) if one.satellite == "scd" and one.rise_tai_s < START + 2400.0]
    assert (scd.state, scd.reason.split(",")[0]) == (PassState.FAILED, "not begun: wind strong")


@pytest.mark.long
def test_a_persons_stow_lets_no_pass_begin_until_a_person_ends_it(tmp_path: Path) -> None:
    answers: list[str] = []
    script = [(START + 5.0, says("stow", answers)), (RISE + 20.0, says("unstow", answers))]
    found = night(tmp_path, minutes=4.9, script=script)
    assert modes(found, START + 30.0, RISE + 19.0) == {AcuMode.STOWED}
    assert AcuMode.AUTOTRACK in modes(found, RISE + 60.0, RISE + 88.0)
    assert [one.split(":")[0] for one in answers] == ["ok stowed", "ok the stow is over, it was the operator's"]


@pytest.mark.long
def test_a_strong_winds_stow_is_no_persons_to_end_and_a_stale_ones_is(tmp_path: Path) -> None:
    answers: list[str] = []
    script = [
        (START, blows(tmp_path, STRONG)),
        (START + 20.0, says("unstow", answers)),
        (START + 100.0, says("unstow", answers)),
    ]
    found = night(tmp_path, watched(tmp_path, "max_age_s = 60\n"), minutes=3.7, script=script)
    assert answers[0].startswith("error the wind strong, mean 12.0 m/s, gusts 20.0 m/s, stow")
    assert answers[1] == "ok the stow is over, it was the wind's"
    assert AcuMode.AUTOTRACK in modes(found, RISE, RISE + 16.0)


def test_a_disarmed_antenna_is_not_stowed_and_that_is_an_alarm(tmp_path: Path) -> None:
    answers: list[str] = []
    script = [(START + 1.0, says("disarm", answers)), (START + 3.0, blows(tmp_path, STRONG))]
    script += [(START + 30.0, says("status", answers)), (START + 31.0, says("arm", answers))]
    found = night(tmp_path, watched(tmp_path), minutes=1.0, script=script)
    assert '"stow_alarm": "not stowed, though the wind is strong: disarmed"' in answers[1]
    assert modes(found, START, START + 30.0) == {AcuMode.STANDBY}
    assert found.days.rows[-1].mode is AcuMode.STOWED

"""What a person says to the running station of passes: skip, pause, and a nudge that is kept."""

from pathlib import Path

import pytest
from test_clock_set_late import between_runs
from test_station import START, configured, night
from test_station_stow import RISE, modes, says

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.pass_course import KeptNudge
from acu_daemon.cli.virtual_station import KilledError, StationAccess, run_days
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import PassState
from acu_daemon.sim.trace import TraceRow

ENDS_S = 4.8  # minutes from START
ACROSS_DEG = 0.4


@pytest.mark.long
@pytest.mark.parametrize("words", ["", f" satellite=scd at={utc_text(RISE + 30.0)}"])
def test_a_pass_that_is_skipped_by_name_or_without_is_given_up_with_a_stop_and_cancelled(
    tmp_path: Path, words: str
) -> None:
    answers: list[str] = []
    found = night(tmp_path, minutes=ENDS_S, script=[(RISE + 15.0, says(f"skip{words}", answers))])
    assert answers[0].startswith("ok given up: scd of ")
    assert (found.of("scd").state, found.of("scd").reason) == (PassState.CANCELLED, "skipped by a person")
    assert modes(found, RISE + 17.0, RISE + 80.0) == {AcuMode.STANDBY}


def test_the_next_pass_is_skipped_or_not_by_a_word_and_another_gets_its_time(tmp_path: Path) -> None:
    answers: list[str] = []
    at = utc_text(RISE + 30.0)
    script = [
        (START + 1.0, says("skip", answers)),
        (START + 3.0, says(f"unskip satellite=scd at={at}", answers)),
        (START + 5.0, says(f"skip satellite=scd at={at}", answers)),
        (START + 7.0, says("skip satellite=none at=2026-01-01T00:00:00Z", answers)),
    ]
    found = night(tmp_path, minutes=0.3, script=script)
    assert [one.split(" ")[0] for one in answers] == ["ok", "ok", "ok", "error"]
    assert (found.of("scd").state, found.of("scd").reason) == (PassState.REFUSED, "excluded by a person")
    assert found.of("behind").state is PassState.PLANNED


@pytest.mark.long
def test_a_pause_begins_no_pass_and_what_it_costs_is_cancelled_by_name(tmp_path: Path) -> None:
    answers: list[str] = []
    until = utc_text(START + 1000.0, 0)
    script = [(START + 1.0, says(f"pause until={until}", answers)), (START + 2.0, says("pause until=soon", answers))]
    found = night(tmp_path, minutes=ENDS_S, script=script)
    assert [one.split(":")[0] for one in answers] == [f"ok no pass is begun until {until[:13]}", "error until 'soon'"]
    assert (found.of("scd").state, found.of("scd").reason) == (PassState.CANCELLED, f"paused by a person until {until}")
    assert modes(found, START, RISE + 80.0) == {AcuMode.STANDBY}


def test_what_a_person_says_after_the_last_tick_of_a_pass_is_for_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The safe stop takes a while; what was said in it was answered with ok, and lost."""
    answers: list[str] = []
    heard: list[StationAccess] = []

    def say() -> None:
        if answers == ["ok given up: scd of 1989-02-01T02:06:26Z"]:
            says("stow", answers)(heard[0])

    between_runs(monkeypatch, say)
    script = [(START, heard.append), (RISE + 15.0, says("skip", answers))]
    found = night(tmp_path, minutes=ENDS_S, script=script)
    assert answers[1].startswith("ok stowed")
    assert modes(found, RISE + 50.0, RISE + 80.0) == {AcuMode.STOWED}
    assert [one["by"] for one in found.days.named("stow.begins")] == ["operator"]


def test_a_nudge_that_is_kept_is_of_the_satellite_while_its_elements_hold(tmp_path: Path) -> None:
    answers: list[str] = []
    kept: list[KeptNudge | None] = []

    def look(access: StationAccess) -> None:
        elements = "Brouwer means of 1989"
        course = access.runs.day.course
        [nudge] = course._nudges.values()
        kept.extend((nudge, course.nudge_for("scd", nudge.elements), course.nudge_for("scd", elements)))

    script = [
        (RISE - 10.0, says("nudge along_s=0.5 keep=yes", answers)),
        (RISE - 8.0, says("skip", answers)),
        (RISE - 5.0, look),
    ]
    night(tmp_path, minutes=3.4, script=script)
    assert answers[0] == "ok nudged: +0.50 s late, +0.000 deg right in all"
    assert kept[0] is not None
    assert (kept[0].along_s, kept[1], kept[2]) == (0.5, kept[0], None)


def test_a_hold_and_a_nudge_survive_a_kill_in_the_pass_with_the_fit_that_they_are_of(tmp_path: Path) -> None:
    """The antenna follows the moved path before the kill and after it; both are over with the pass."""
    answers: list[str] = []
    seen: list[Snapshot] = []

    def look(access: StationAccess) -> None:
        assert access.runs.service is not None
        seen.append(access.runs.service.snapshot())

    def kill(access: StationAccess) -> None:
        look(access)
        raise KilledError

    config, state = configured(tmp_path / "config"), tmp_path / "state"
    state.mkdir()
    killed_at, ends = RISE + 30.0, RISE + 60.0
    begin = [
        (RISE + 20.0, says("hold", answers)),
        (RISE + 21.0, says(f"nudge across_deg={ACROSS_DEG}", answers)),
        (killed_at, kill),
    ]
    killed = run_days(config, state, START, ends, script=begin)
    after = [(killed_at + 12.0, look), (killed_at + 13.0, says("nudge across_deg=0", answers))]
    after += [(killed_at + 20.0, look)]
    days = run_days(config, state, killed_at + 1.0, ends, script=after, before=killed)
    assert [answer[:2] for answer in answers] == ["ok"] * 3
    assert [one.is_held_by_person for one in seen] == [True] * 3
    assert [one.nudge_across_deg for one in seen] == [ACROSS_DEG, ACROSS_DEG, 0.0]
    errors_deg = [
        worst_beam_error_deg(one.rows, *span)
        for one, span in (
            (killed, (killed_at - 3.0, killed_at)),
            (days, (killed_at + 9.0, killed_at + 12.0)),
            (days, (killed_at + 17.0, killed_at + 20.0)),
        )
    ]
    assert errors_deg == [pytest.approx(ACROSS_DEG, abs=0.08)] * 2 + [pytest.approx(0.0, abs=0.08)]
    assert days.named("run.resumed") != []


def worst_beam_error_deg(rows: list[TraceRow], from_tai_s: float, to_tai_s: float) -> float:
    return max(row.beam_error_deg for row in rows if from_tai_s < row.tai_s < to_tai_s)

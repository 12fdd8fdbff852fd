"""A person's hand in a pass: autotrack left for the prediction, the path moved, and given back."""

from dataclasses import replace
from pathlib import Path

import pytest
from flights import RISING_TAI_S, climb, events_named, rows_between, state_at, worst_error_deg
from memories import remembering
from test_axis_latch import says
from test_tick import CONFIG, FITTED, NOW, SKY, ready, saw, status

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.cli.virtual_pass import ScriptAccess
from acu_daemon.control.state import Nudge
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import HoldWish, NudgeWish, TickInput
from acu_daemon.control.tracking.state_table import TRACKING, TrackState
from acu_daemon.edge.tape_file import SUFFIX
from acu_daemon.model import Model

T = RISING_TAI_S
ACROSS_DEG, ALONG_S = 0.4, 1.0


def test_a_hold_leaves_autotrack_for_the_prediction_and_track_gives_it_back(tmp_path: Path) -> None:
    tape = tmp_path / f"held{SUFFIX}"
    script = [(15.0, says("hold")), (25.0, says("track")), (30.0, says("nudge along_s=0.1")), (31.0, says("stow"))]
    flight = climb(34.0, script=script, tape=tape)
    assert state_at(flight, T + 16.0) == state_at(flight, T + 24.9) == "PROGRAM"
    assert {row.mode for row in rows_between(flight, T + 16.0, T + 25.0)} == {AcuMode.REMOTE}
    assert worst_error_deg(flight, T + 16.0, T + 25.0) < 0.1
    assert flight.states()[-2:] == ["AUTOTRACK/FITTED", "STOW"]
    assert replay_pass(tape).difference is None
    assert {seen.verdict for seen in flight.snapshots if T + 18.0 < seen.tai_s < T + 24.0} == {"HELD"}


def test_a_nudge_moves_the_path_that_is_followed_by_so_much_and_none_undoes_it() -> None:
    script = [
        (14.0, says("hold")),
        (16.0, says(f"nudge across_deg={ACROSS_DEG}")),
        (20.0, says(f"nudge along_s={ALONG_S} across_deg=0")),
        (24.0, says("nudge along_s=0")),
    ]
    flight = climb(28.0, script=script)
    across, along = (rows_between(flight, T + at_s, T + at_s + 1.0) for at_s in (18.5, 22.5))
    assert [row.beam_error_deg for row in across] == [pytest.approx(ACROSS_DEG, abs=0.08)] * len(across)
    speeds = [seen.speed_deg_s for seen in flight.snapshots if T + 22.5 < seen.tai_s < T + 23.5]
    expected_deg = ALONG_S * sum(one or 0.0 for one in speeds) / len(speeds)
    assert [row.beam_error_deg for row in along] == [pytest.approx(expected_deg, rel=0.2)] * len(along)
    assert all((seen.off_path_deg or 0.0) < 0.1 for seen in flight.snapshots if T + 18.5 < seen.tai_s < T + 19.5)
    assert worst_error_deg(flight, T + 26.5, T + 28.0) < 0.1


def test_a_nudge_ends_with_the_fit_that_makes_the_path_anew() -> None:
    flight = climb(8.0, script=[(1.0, says(f"nudge across_deg={ACROSS_DEG / 4}"))])
    assert [one["path"] for one in events_named(flight, "nudge.ends")] == [str(Model.NEW_FIT)]
    assert flight.snapshots[-1].nudge_across_deg == 0.0


def test_what_cannot_be_done_is_refused_with_its_reason() -> None:
    answers: list[str] = []

    def ask(line: str):
        def action(stage: ScriptAccess) -> None:
            answers.append(stage.service.answer(line))

        return action

    climb(5.0, is_resting=True, script=[(4.0, ask("hold")), (4.1, ask("nudge along_s=1"))])
    climb(4.0, script=[(2.0, ask("nudge")), (2.1, ask("nudge along_s=61")), (2.2, ask("disarm")), (3.0, ask("track"))])
    assert answers[:2] == ["error no pass is on"] * 2
    assert answers[2] == "error nudge: expected along_s=, across_deg= or both"
    assert answers[3] == "error along_s=61: expected -60 to 60 s"
    assert answers[5] == "error disarmed: `acu-daemon arm` first"


@pytest.mark.parametrize("track", sorted(TRACKING - {TrackState.PROGRAM, TrackState.ZENITH}))
def test_a_hold_ends_every_state_that_autotrack_has_a_say_in(track: TrackState) -> None:
    state, _ = tick(ready(track, status()), TickInput(saw(status(), requests=(HoldWish(),)), FITTED, NOW), CONFIG)
    assert state.tracking.track is TrackState.PROGRAM


def test_a_shadow_obeys_no_hand() -> None:
    given = TickInput(saw(status(), requests=(HoldWish(), NudgeWish(1.0, 1.0))), SKY, NOW)
    state, _ = tick(ready(TrackState.AUTOTRACK_TLE, status()), given, replace(CONFIG, is_shadow=True))
    assert (state.by_hand.is_held, state.by_hand.nudge) == (False, None)


def test_a_nudge_that_was_kept_belongs_to_the_first_model_of_the_pass() -> None:
    kept = remembering(ready(TrackState.HOLD_TLE, status()), nudge=Nudge(1.0, 0.1))
    state, _ = tick(kept, TickInput(saw(status()), SKY, NOW), CONFIG)
    assert state.by_hand.nudge == Nudge(1.0, 0.1, Model.ELEMENTS)

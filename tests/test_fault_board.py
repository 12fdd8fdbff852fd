"""When a planned fault is present, which frames and axes it hits, and the control port."""

import asyncio
from dataclasses import replace

import pytest
from fake_sky import Bench

from acu_daemon.edge.clock import LoopClock
from acu_daemon.sim.acu_faults import break_acu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_control import answer_line
from acu_daemon.sim.fault_verbs import Direction, parse_fault
from acu_daemon.sim.pedestal import AxisTrouble
from acu_daemon.sim.virtual import run_virtual


def history(*faults: str, until_s: float = 20.0) -> list[tuple[float, str, bool]]:
    """When the faults that last begin and end."""

    async def main() -> list[tuple[float, str, bool]]:
        loop = asyncio.get_running_loop()
        seen: list[tuple[float, str, bool]] = []
        board = FaultBoard()
        board.listen(lambda fault, is_on: seen.append((round(loop.time(), 3), fault.verb, is_on)))
        for text in faults:
            board.add(parse_fault(text))
        await asyncio.sleep(until_s)
        return seen

    return run_virtual(main())


def test_a_fault_that_lasts_begins_at_its_start_and_ends_after_its_duration() -> None:
    assert history("stuck start_s=2 duration_s=3") == [(2.0, "stuck", True), (5.0, "stuck", False)]


def test_a_count_repeats_it_with_pauses_as_long_as_itself() -> None:
    times = [time_s for time_s, _, _ in history("stuck start_s=1 duration_s=2 count=3")]
    assert times == [1.0, 3.0, 5.0, 7.0, 9.0, 11.0]


def test_a_fault_of_an_instant_has_no_end() -> None:
    assert history("reset start_s=1 count=2 duration_s=4") == [(1.0, "reset", True), (5.0, "reset", True)]


def test_a_probability_is_rolled_for_every_time_it_happens_and_a_seed_repeats_it() -> None:
    times = [history(f"reset count=40 duration_s=0.1 probability=0.5 seed={seed}") for seed in (1, 1, 2)]
    assert times[0] == times[1] != times[2]
    assert 10 < len(times[0]) < 30


def test_faults_of_one_axis_that_overlap_each_end_by_themselves() -> None:
    async def main() -> list[AxisTrouble | None]:
        bench, board = Bench(), FaultBoard()
        break_acu(bench.acu, board, LoopClock(bench.tai_s))
        for text in (
            "stuck duration_s=4",
            "wind start_s=1 duration_s=1",
            "limit-switch axis=both start_s=1 duration_s=1",
        ):
            board.add(parse_fault(text))
        seen = []
        for _ in range(3):
            await asyncio.sleep(1.5)
            trouble = bench.acu.antenna.az.trouble
            seen.append(trouble and replace(trouble))
        return seen

    both, one, none = run_virtual(main())
    assert both is not None
    assert (both.is_stuck, both.gust_deg_s, both.upper_stop_deg) == (True, 0.5, 30.0)
    assert one == AxisTrouble(is_stuck=True)
    assert none is None


def strikes(text: str, frame_count: int, way: Direction = "reply") -> list[bool]:
    """Which frames of a direction, one each 0.1 s, a fault hits."""

    async def main() -> list[bool]:
        board = FaultBoard()
        fault = parse_fault(text)
        board.add(fault)
        hits = []
        for _ in range(frame_count):
            await asyncio.sleep(0.1)
            hits.append(board.strike(fault.verb, way) is not None)
        return hits

    return run_virtual(main())


def test_a_fault_of_frames_hits_as_many_as_its_count_within_its_time() -> None:
    assert strikes("no-reply count=2", 4) == [True, True, False, False]
    assert strikes("no-reply start_s=0.15 duration_s=0.2", 5) == [False, True, True, False, False]
    assert strikes("no-reply on=command", 2) == [False, False]
    some = strikes("no-reply probability=0.3 seed=3", 400)
    assert sum(some) == pytest.approx(120, abs=40)
    assert some == strikes("no-reply probability=0.3 seed=3", 400)


@pytest.mark.parametrize("way", ["reply", "command"])
def test_a_wrong_baud_rate_hits_both_directions_and_other_faults_the_one_they_name(way: Direction) -> None:
    assert strikes("wrong-baud", 1, way) == strikes("nak", 1, way) == [True]
    assert strikes("truncated", 1, way) == [way == "reply"]
    assert strikes("truncated on=command", 1, way) == [way == "command"]


def test_the_control_port_adds_lists_and_clears() -> None:
    async def main() -> list[str]:
        board = FaultBoard({"no-reply", "stuck"})
        lines = ["fault no-reply count=3", "fault stuck start_s=5 duration_s=1", "list", "clear 1", "clear stuck"]
        lines += ["list", "clear", "clear 9", "fault refuse", "fault", "shout", "fault stuck count=x"]
        answers = []
        for line in lines:
            answers.append(answer_line(board, line + "\r\n"))
            await asyncio.sleep(0.1)
        return [*answers, answer_line(board, "help")]

    answers = run_virtual(main())
    assert answers[:8] == [
        "ok 1",
        "ok 2",
        "ok 1 on hits=0 no-reply count=3; 2 planned hits=0 stuck start_s=5 duration_s=1",
        "ok 1 cleared",
        "ok 1 cleared",
        "ok none",
        "ok 0 cleared",
        "error there is no fault '9'; list shows those there are",
    ]
    assert answers[8] == "error refuse: this program and this link cannot do that"
    assert all(answer.startswith("error ") for answer in answers[8:12])
    assert "xor-blind" in answers[12]


@pytest.mark.parametrize("axes", ["azimuth", "elevation", "both"])
def test_a_frozen_encoder_keeps_showing_the_angle_of_its_own_axis(axes: str) -> None:
    async def main() -> None:
        bench, board = Bench(), FaultBoard()
        break_acu(bench.acu, board, LoopClock(bench.tai_s))
        board.add(parse_fault(f"frozen-encoder axis={axes} duration_s=1"))
        await asyncio.sleep(0.5)
        antenna = bench.acu.antenna
        assert antenna.az.angle_deg != antenna.el.angle_deg
        assert antenna.trouble.frozen_az_deg == (None if axes == "elevation" else antenna.az.angle_deg)
        assert antenna.trouble.frozen_el_deg == (None if axes == "azimuth" else antenna.el.angle_deg)
        await asyncio.sleep(1.0)
        assert (antenna.trouble.frozen_az_deg, antenna.trouble.frozen_el_deg) == (None, None)

    run_virtual(main())

"""The fit in a real child process: the same answers as inline, and what happens when the child dies or hangs."""

import asyncio
import os
import pickle
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import made_orbits
import numpy as np
import pytest

from acu_daemon.assist.estimators.estimator import ESTIMATORS, EstimatorSettings
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup
from acu_daemon.control.tracking.pass_plan import PlanRequest
from acu_daemon.edge.fit import FitFailedError, InlineFitRunner, ProcessFitRunner
from acu_daemon.edge.fit_child import LENGTH
from acu_daemon.model import AxisLimits, Correction, Readings
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.pointing.envelope import Envelope

pytestmark = pytest.mark.realtime

ORBIT = made_orbits.circular()
SITE = made_orbits.site()
TRUTH = ORBIT.corrected(Correction(delta_mean_anomaly_rad=0.002))
AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
START = float(made_orbits.visible(ORBIT, SITE)[0])
PATIENT_S = 120.0  # no time limit of a test depends on the machine


def setup(estimator: str = "kalman") -> RefitSetup:
    return RefitSetup(ORBIT, SITE, estimator, EstimatorSettings(), AZIMUTH)


def request(second: int, reading_count: int = 10) -> RefitRequest:
    """The readings of one second of the pass, and a prediction from its end on."""
    tai_s = START + second + 0.1 * np.arange(reading_count)
    look = look_at(TRUTH, tai_s, SITE)
    end = START + second + 1.0
    return RefitRequest(Readings(tai_s, look.az_deg, look.el_deg), end, 5.0, end, 180.0)


def empty(second: int) -> RefitRequest:
    return replace(request(second), readings=Readings(np.empty(0), np.empty(0), np.empty(0)))


def same(one: RefitReply, other: RefitReply) -> bool:
    """Bit for bit."""
    arrays = [(getattr(one.prediction, name), getattr(other.prediction, name)) for name in ("az_deg", "el_deg")]
    return one.fit == other.fit and all((a == b).all() for a, b in arrays)


async def inline(requests: list[RefitRequest], estimator: str = "kalman") -> list[RefitReply]:
    runner = InlineFitRunner(setup(estimator), latency_s=0.0)
    return [await runner.refit(one) for one in requests]


async def failure(runner: ProcessFitRunner, one: RefitRequest) -> str:
    with pytest.raises(FitFailedError) as error:
        await runner.refit(one)
    return str(error.value)


@pytest.mark.parametrize("estimator", sorted(ESTIMATORS))
async def test_the_child_answers_as_inline_bit_for_bit(estimator: str) -> None:
    requests = [empty(0), request(0), request(1), empty(2), request(3)]
    runner = ProcessFitRunner(setup(estimator), PATIENT_S)
    replies = [await runner.refit(one) for one in requests]
    await runner.close()
    for here, there in zip(await inline(requests, estimator), replies, strict=True):
        assert same(here, there)
    assert replies[0].fit is None
    assert replies[0].prediction.kind == "TLE"
    assert replies[-1].fit is not None
    assert replies[-1].prediction.kind == "FITTED"
    assert runner.start_count == 1


async def test_the_child_plans_a_pass_as_inline_and_takes_no_harm_from_one_that_it_cannot_plan() -> None:
    coming = next(iter(find_passes(ORBIT, SITE, START - 600.0, START + 3600.0, 5.0)))
    asked = PlanRequest(coming, 10.0, 45.0, Envelope(AZIMUTH, ELEVATION), START - 500.0, 0, setup().keyhole)
    runner = ProcessFitRunner(setup(), PATIENT_S)
    planned = await runner.plan(asked)
    backwards = replace(asked, coming=replace(coming, set_tai_s=float("nan")))
    with pytest.raises(FitFailedError):
        await runner.plan(backwards)
    assert planned == await InlineFitRunner(setup()).plan(asked) == await runner.plan(asked)
    await runner.close()
    assert runner.start_count == 1
    assert planned.plan.rise_tai_s == coming.rise_tai_s


async def test_a_killed_child_is_replaced_and_given_all_readings_again() -> None:
    requests = [request(second) for second in range(4)]
    runner = ProcessFitRunner(setup(), PATIENT_S)
    await runner.refit(requests[0])
    assert runner.pid is not None
    os.kill(runner.pid, signal.SIGKILL)
    assert "died" in await failure(runner, requests[1])
    await runner.refit(requests[2])
    last = await runner.refit(requests[3])
    await runner.close()
    assert runner.start_count == 2
    assert last.fit is not None
    undisturbed = (await inline(requests))[-1]
    assert undisturbed.fit is not None
    assert last.fit.reading_count == undisturbed.fit.reading_count
    assert np.allclose(last.prediction.az_deg, undisturbed.prediction.az_deg, rtol=0, atol=1e-6)


async def test_a_child_killed_between_questions_costs_at_most_one_answer() -> None:
    runner = ProcessFitRunner(setup(), PATIENT_S)
    await runner.refit(request(0))
    assert runner.pid is not None
    os.kill(runner.pid, signal.SIGKILL)
    await runner._child.wait()  # type: ignore[union-attr]
    reply = await runner.refit(request(1))
    await runner.close()
    assert reply.fit is not None
    assert reply.fit.reading_count == 20


async def test_a_hung_child_is_ended_and_replaced() -> None:
    runner = ProcessFitRunner(setup(), PATIENT_S)
    await runner.refit(request(0))
    hung = runner.pid
    assert hung is not None
    os.kill(hung, signal.SIGSTOP)
    runner._timeout_s = 0.2
    assert await failure(runner, request(1)) == "the fit process gave no answer within 0.2 s"
    with pytest.raises(ProcessLookupError):
        os.kill(hung, 0)
    runner._timeout_s = PATIENT_S
    reply = await runner.refit(request(2))
    await runner.close()
    assert reply.fit is not None
    assert reply.fit.reading_count == 30
    assert runner.start_count == 2


async def test_a_child_that_talks_nonsense_is_ended_and_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nonsense = tmp_path / "nonsense"
    nonsense.write_text("#!/bin/sh\nprintf '\\012\\0\\0\\0\\0\\0\\0\\0no pickle.'\nexec sleep 1000\n")
    nonsense.chmod(0o755)
    runner = ProcessFitRunner(setup(), PATIENT_S)
    with monkeypatch.context() as other:
        other.setattr(sys, "executable", str(nonsense))
        assert "its answer makes no sense" in await failure(runner, request(0))
    assert runner.pid is None
    assert (await runner.refit(request(1))).fit is not None
    await runner.close()


async def test_a_starting_child_has_more_time_than_an_answer() -> None:
    runner = ProcessFitRunner(setup(), timeout_s=0.0)
    reply = await runner.refit(empty(0))
    assert reply.prediction.kind == "TLE"
    assert await failure(runner, empty(1)) == "the fit process gave no answer within 0 s"
    await runner.close()


async def test_a_cancelled_question_leaves_no_answer_for_the_next_one() -> None:
    runner = ProcessFitRunner(setup(), PATIENT_S)
    await runner.refit(request(0))
    asked = asyncio.create_task(runner.refit(request(1)))
    await asyncio.sleep(0)
    asked.cancel()
    with pytest.raises(asyncio.CancelledError):
        await asked
    reply = await runner.refit(request(2))
    await runner.close()
    assert reply.prediction.start_tai_s == request(2).start_tai_s
    assert reply.fit is not None
    assert reply.fit.reading_count == 30


async def test_a_fit_that_fails_says_why_and_leaves_the_child_alive() -> None:
    runner = ProcessFitRunner(setup(), PATIENT_S)
    await runner.refit(request(0))
    said = await failure(runner, replace(empty(1), horizon_s=float("nan")))
    assert said.startswith("the fit failed: ")
    reply = await runner.refit(request(2))
    await runner.close()
    assert runner.start_count == 1
    assert reply.fit is not None


async def test_the_child_is_nice_and_ends_with_its_parent() -> None:
    runner = ProcessFitRunner(setup(), PATIENT_S)
    await runner.refit(request(0))
    child = runner.pid
    assert child is not None
    own = os.getpriority(os.PRIO_PROCESS, 0)
    assert os.getpriority(os.PRIO_PROCESS, child) == min(19, max(10, own + 10))
    await runner.close()
    assert runner.pid is None
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)
    await runner.close()


def test_a_child_whose_parent_is_gone_ends_by_itself_without_a_word() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "acu_daemon.edge.fit_child"], stdin=subprocess.DEVNULL, capture_output=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


@pytest.mark.parametrize(("daemons", "childs"), [(-10, 10), (0, 10), (4, 14)])
def test_the_child_is_nice_however_its_parent_is(daemons: int, childs: int) -> None:
    code = f"import os; os.nice({daemons} - os.nice(0)); from acu_daemon.edge.fit_child import be_nice; be_nice()"
    done = subprocess.run([sys.executable, "-c", f"{code}; print(os.nice(0))"], capture_output=True, text=True)
    if "PermissionError" in done.stderr:
        pytest.skip(f"only root may make a process {daemons}")
    assert done.stdout == f"{childs}\n"


def test_what_a_library_prints_in_the_child_is_no_reply() -> None:
    code = (
        "import acu_daemon.edge.fit_child as c; import acu_daemon.assist.session.refit as r; "
        "r.Refitter = print; c.serve()"
    )
    greeting = pickle.dumps(((), "a library says hello"))
    done = subprocess.run(
        [sys.executable, "-c", code], input=LENGTH.pack(len(greeting)) + greeting, capture_output=True, check=False
    )
    assert done.stdout == b""
    assert b"a library says hello" in done.stderr


def loaded_by(module: str) -> set[str]:
    code = f"import {module}, sys; print(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


def test_the_child_is_nice_before_it_loads_what_takes_long() -> None:
    assert "numpy" not in loaded_by("acu_daemon.edge.fit_child")


def test_the_child_loads_only_what_a_fit_needs() -> None:
    loaded = loaded_by("acu_daemon.edge.fit_child") | loaded_by("acu_daemon.assist.session.refit")
    assert not loaded & {"asyncio", "structlog", "rich", "pydantic", "typer", "serial", "matplotlib"}

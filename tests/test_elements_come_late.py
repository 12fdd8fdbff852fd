"""New elements moved into place while the daemon waits are taken before the pass, unless they are worse."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from evolved_sets import later
from flights import DEMO_TAI_S
from waiting import Story, tell

import acu_daemon.cli as cli
from acu_daemon.acu.commands import Stop
from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.edge.elements_store import record_of
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc

DEMO = Path(cli.__file__).parent / "demo_config"
RISE_TAI_S = coming_pass(load_target(DEMO, "demo-1", DEMO_TAI_S), DEMO_TAI_S).rise_tai_s
OLD = 1.0  # seconds of 1970: a file that is not being written just now
LATER_DAYS = 2.0  # to the morning of the pass


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """The demo's, with elements of two days before."""
    shutil.copytree(DEMO, tmp_path / "config")
    (tmp_path / "config" / "satellites" / "demo-1.tle").write_text(with_epoch(DEMO, -LATER_DAYS))
    for path in (tmp_path / "config").rglob("*"):
        os.utime(path, (OLD, OLD))
    return tmp_path / "config"


def lines(config: Path) -> list[str]:
    return (config / "satellites" / "demo-1.tle").read_text().splitlines()


def sealed(line: str) -> str:
    """The line with its check digit."""
    body = line[:68]
    return body + str(sum(int(c) if c.isdigit() else c == "-" for c in body) % 10)


def with_epoch(config: Path, by_days: float) -> str:
    """The same orbit at another epoch: the anomaly moved on by the mean motion."""
    *name, first, second = lines(config)
    epoch_day = float(first[20:32]) + by_days
    anomaly_deg = (float(second[43:51]) + 360.0 * float(second[52:63]) * by_days) % 360.0
    first = sealed(f"{first[:20]}{epoch_day:012.8f}{first[32:]}")
    second = sealed(f"{second[:43]}{anomaly_deg:8.4f}{second[51:]}")
    return "\n".join([*name, first, second]) + "\n"


def moves(text: str, to: str = "satellites/demo-1.tle") -> Callable[[Story], None]:
    """Somebody writes a file beside and moves it into place."""

    def act(story: Story) -> None:
        beside = story.config / "beside"
        beside.write_text(text)
        os.utime(beside, (OLD + 1.0, OLD + 1.0))
        beside.replace(story.config / to)

    return act


def wait_with(config: Path, directory: Path, *texts: str) -> Story:
    """Six minutes before the rise files come, five seconds one after the other; the pass is not waited for."""
    actions = [(5.0 * (i + 1), moves(text)) for i, text in enumerate(texts)]
    return tell(Story(config, RISE_TAI_S - 360.0, 5.0 * len(texts) + 10.0, actions=actions), directory)


def test_newer_elements_are_taken_while_it_waits_and_told(config: Path, tmp_path: Path) -> None:
    """They were ignored until the next start."""
    epoch_tai_s = load_target(config, "demo-1", DEMO_TAI_S).elements.epoch_tai_s
    told = wait_with(config, tmp_path / "state", with_epoch(config, LATER_DAYS))
    [taken] = told.named("elements.taken")
    assert tai_from_utc(taken["epoch"]) == pytest.approx(epoch_tai_s + LATER_DAYS * 86400.0, abs=1.0)
    assert [event["reason"] for event in told.named("run.anew")] == ["elements"]
    before, after = (one.job.refit.propagator.epoch_tai_s for one in told.jobs)
    assert after - before == pytest.approx(LATER_DAYS * 86400.0, abs=1.0)
    assert told.jobs[1].target.elements.propagator is told.jobs[1].job.refit.propagator
    assert told.commands.count(Stop()) == 1  # the one at the end
    assert told.outcome is not None
    assert told.outcome.is_stopped


@pytest.mark.long
def test_the_pass_is_tracked_with_the_elements_that_came_while_it_was_waited_for(config: Path, tmp_path: Path) -> None:
    actions = [(5.0, moves(with_epoch(config, LATER_DAYS)))]
    told = tell(Story(config, RISE_TAI_S - 180.0, 240.0, actions=actions), tmp_path / "state")
    assert len(told.jobs) == 2
    assert told.snapshots[-1].state == "AUTOTRACK/FITTED"


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (lambda config: with_epoch(config, -0.5), "the new ones are older"),
        (lambda _config: "<html>404 not found</html>\n", "cannot be used"),
        (lambda _config: "", "cannot be used"),
        (lambda config: with_epoch(config, 20.0), "further from the coming pass"),
    ],
    ids=["older", "a page of a web server", "empty", "far ahead"],
)
def test_worse_elements_are_left_and_told(
    made: Callable[[Path], str], reason: str, config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("acu_daemon.edge.elements_file.RECENT_S", -1.0)
    told = wait_with(config, tmp_path / "state", made(config))
    [kept] = told.named("elements.kept")
    assert reason in kept["reason"]
    assert len(told.jobs) == 1


def test_a_file_that_was_only_touched_is_no_news(config: Path, tmp_path: Path) -> None:
    told = wait_with(config, tmp_path / "state", "\n".join(lines(config)) + "\n")
    assert (told.named("elements.taken"), told.named("elements.kept"), len(told.jobs)) == ([], [], 1)


def test_after_worse_ones_good_ones_are_still_taken(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("acu_daemon.edge.elements_file.RECENT_S", -1.0)
    told = wait_with(config, tmp_path / "state", "half a fi", with_epoch(config, LATER_DAYS))
    assert (len(told.named("elements.kept")), len(told.named("elements.taken"))) == (1, 1)


@pytest.mark.long
def test_in_mid_pass_nothing_is_taken(config: Path, tmp_path: Path) -> None:
    actions = [(20.0, moves(with_epoch(config, LATER_DAYS)))]
    told = tell(Story(config, RISE_TAI_S + 1.0, 40.0, actions=actions), tmp_path / "state")
    assert len(told.jobs) == 1
    assert told.named("elements.taken") == []


@pytest.mark.parametrize("is_right", [True, False], ids=["right", "another orbit's"])
def test_a_directory_that_others_fill_is_looked_at_while_it_waits(config: Path, tmp_path: Path, is_right: bool) -> None:
    """The node of this orbit goes a degree a day; a set whose node stood still is 240 km beside it."""
    station = config / "station.toml"
    station.write_text(station.read_text() + '\n[elements]\nsource = "given"\n')
    os.utime(station, (OLD, OLD))
    (config / "given").mkdir()
    source = load_target(config, "demo-1", DEMO_TAI_S).elements.propagator
    assert isinstance(source, Sgp4Propagator)
    right = json.dumps([record_of(later(LATER_DAYS, source.elements), "test")])
    given = moves(right if is_right else with_epoch(config, LATER_DAYS), to="given/demo-1.txt")
    told = tell(Story(config, RISE_TAI_S - 360.0, 25.0, actions=[(5.0, given)]), tmp_path / "state")
    assert len(told.named("elements.taken")) == is_right
    assert ["is doubted" in one["reason"] for one in told.named("elements.kept")] == ([] if is_right else [True])
    assert len(told.jobs) == 1 + is_right

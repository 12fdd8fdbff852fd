"""The report of a pass, made from its recording: true, whole without a network, and every figure in its JSON."""

import gzip
import json
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from command_line import acu_daemon
from fault_tapes import TROUBLES, path_of
from flights import climb

from acu_daemon.acu.commands import Poll
from acu_daemon.cli.report_command import make_report, write_index
from acu_daemon.control.orders import Orders
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import PassPlan, Sky
from acu_daemon.edge.tape_file import SUFFIX
from acu_daemon.report.pass_losses import losses_of
from acu_daemon.report.pass_page import pass_page, verdict_of
from acu_daemon.report.pass_watch import PassWatch, SeenReading
from acu_daemon.report.svg_chart import ChartLine, chart, nice, sparkline

MOST_BYTES = 1_000_000
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])")
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reports")


@cache
def figures_of(name: str, folder: Path) -> dict[str, Any]:
    make_report(path_of(name), folder)
    read: dict[str, Any] = json.loads((folder / f"{name}.json").read_text())
    return read


def shown(page: str) -> str:
    """What a person reads on a page: no style, no drawings, no tags."""
    bare = re.sub(r"<(style|svg|title)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return unescape(re.sub(r"<[^>]+>", " ", bare))


def times_and_words_left_out(text: str) -> str:
    text = re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d(:\d\d)?Z?|\d\d:\d\d:\d\d(\.\d+)?|99 %", " ", text)
    return text.replace("1 sigma", " ").replace("3 sigma", " ")


def numbers_in(read: Any) -> set[str]:
    """Every number of a JSON, and those within its texts."""
    if isinstance(read, dict):
        return set().union(*(numbers_in(one) for one in read.values()), *(numbers_in(key) for key in read))
    if isinstance(read, list):
        return set().union(*map(numbers_in, read))
    if isinstance(read, bool) or read is None:
        return set()
    return set(NUMBER.findall(read)) if isinstance(read, str) else {str(read)}


@pytest.mark.parametrize("name", ["receiver-fault", "local-panel", "latch"])
def test_every_figure_of_the_page_is_in_its_json_and_the_page_has_no_outside_parts(name: str, folder: Path) -> None:
    read = figures_of(name, folder)
    page = (folder / f"{name}.html").read_text()
    known = numbers_in(read) | {str(len(read["losses"]))}
    assert set(NUMBER.findall(times_and_words_left_out(shown(page)))) - known == set()
    assert re.findall(r"https?://|\bsrc=|@import|url\(|<link|<script", page) == []
    assert len(page.encode()) < MOST_BYTES


def test_what_came_is_what_the_flight_was_given(folder: Path) -> None:
    read = figures_of("receiver-fault", folder)
    lengths = [end - begin for begin, end in TROUBLES["receiver-fault"].losses]
    assert [one["length_s"] for one in read["losses"]] == pytest.approx(lengths, abs=0.21)
    assert {state["state"] for one in read["losses"] for state in one["followed"]} == {"HOLD/FITTED"}
    assert max(one["relock_s"] for one in read["losses"]) < 0.5
    assert read["outcome"]["largest_off_path_in_losses_beamwidths"] < 0.2
    before, after = read["residuals"]["before"]["rms_deg"], read["residuals"]["after"]["rms_deg"]
    assert after < 0.04 < before
    assert read["correction"]["along_s"] == pytest.approx(0.9, abs=0.4)
    assert 0.0 < read["correction"]["along_sigma_s"] < 0.1
    assert read["latency"]["p99_ms"] == pytest.approx(10.0, abs=0.1)
    assert read["replay"] == {"is_same": True, "difference": None}
    assert verdict_of(read) == ("tracked through 3 losses", "good")


def test_refused_commands_and_a_line_that_was_lost_are_in_the_report(tmp_path: Path, folder: Path) -> None:
    path = tmp_path / f"nak{SUFFIX}"
    climb(8.0, faults=["nak start_s=5 duration_s=0.5"], tape=path)
    make_report(path, tmp_path)
    refused = json.loads((tmp_path / "nak.json").read_text())["refused"]
    assert len(refused) > 2
    assert any(one["command"].startswith("PointAndPoll") for one in refused)
    lost = figures_of("silence-of-the-line", folder)["line"]
    assert [one["text"] == "open" for one in lost] == [True, False, True]
    assert "no valid reply" in lost[1]["text"]


def test_hooks_and_the_schedule_are_in_the_report(tmp_path: Path) -> None:
    path = tmp_path / f"hooks{SUFFIX}"
    hook = {"hook": "at_loss", "status": 3, "lasted_s": 0.25, "problem": "exit status 3", "said": "<no disk>"}
    with gzip.open(path_of("latch"), "rt") as file:
        text = file.read()
    more = f"Ihook {json.dumps(hook)}\nIschedule {json.dumps({'priority': 7})}\n"
    with gzip.open(path, "wt") as file:
        file.write(text + more)
    make_report(path, tmp_path)
    read = json.loads((tmp_path / "hooks.json").read_text())
    assert (read["hooks"], read["schedule"]) == ([hook], {"priority": 7})
    page = (tmp_path / "hooks.html").read_text()
    assert "exit status 3" in page
    assert "<no disk>" not in page


def test_what_is_written_by_others_is_no_part_of_the_page(folder: Path) -> None:
    read = json.loads(json.dumps(figures_of("latch", folder)))
    read["pass"]["satellite"] = read["events"][0]["said"] = "<script>alert(1)</script>"
    assert "<script>" not in pass_page(read)


def test_a_recording_of_a_moment_and_one_without_any_signal_have_a_report(tmp_path: Path) -> None:
    path = tmp_path / f"short{SUFFIX}"
    climb(3.0, losses=[(-5.0, 4.0)], tape=path)
    make_report(path, tmp_path)
    read = json.loads((tmp_path / "short.json").read_text())
    assert verdict_of(read) == ("never acquired", "bad")
    assert read["correction"] is None
    cut = tmp_path / f"cut{SUFFIX}"
    cut.write_bytes(path.read_bytes()[:1500])
    make_report(cut, tmp_path)
    assert json.loads((tmp_path / "cut.json").read_text())["pass"]["is_recording_whole"] is False


def test_the_command_makes_report_and_index_and_says_where(tmp_path: Path) -> None:
    for name in ("latch", "clock-step"):
        shutil.copy(path_of(name), tmp_path)
    done = acu_daemon("report", tmp_path)
    assert done.code == 0
    assert done.out.split() == [str(tmp_path / name) for name in ("clock-step.html", "latch.html", "index.html")]
    index = json.loads((tmp_path / "index.json").read_text())
    assert [row["name"] for row in index["passes"]] == ["clock-step", "latch"]
    page = (tmp_path / "index.html").read_text()
    assert page.count("<svg") == 8
    known = numbers_in(index) | {str(len(index["passes"]))}
    assert set(NUMBER.findall(times_and_words_left_out(shown(page)))) - known == set()
    assert acu_daemon("report", tmp_path / "nothing").code == 2


def test_a_recording_that_is_none_or_damaged_is_told_and_all_others_have_their_report(tmp_path: Path) -> None:
    (tmp_path / f"empty{SUFFIX}").write_bytes(b"")  # of a daemon that was killed before its first line
    with gzip.open(path_of("latch"), "rt") as file:
        lines = file.read().splitlines()
    with gzip.open(tmp_path / f"torn{SUFFIX}", "wt") as file:
        file.write("\n".join([*lines[:800], "W?", *lines[800:]]) + "\n")
    shutil.copy(path_of("latch"), tmp_path)
    done = acu_daemon("report", tmp_path)
    assert done.code == 2
    assert f"no report: {tmp_path / f'empty{SUFFIX}'}" in done.err
    assert "line 801: 'W?'" in done.err
    assert done.out.split() == [str(tmp_path / name) for name in ("latch.html", "torn.html", "index.html")]
    assert json.loads((tmp_path / "torn.json").read_text())["pass"]["is_recording_whole"] is False
    assert acu_daemon("report", tmp_path / f"torn{SUFFIX}").code == 1


@pytest.mark.long
def test_a_pass_that_is_lost_for_good_is_told_as_lost_and_not_as_tracked(tmp_path: Path) -> None:
    path = tmp_path / f"lost{SUFFIX}"
    climb(45.0, losses=[(8.0, 60.0)], tape=path)
    make_report(path, tmp_path)
    read = json.loads((tmp_path / "lost.json").read_text())
    assert read["outcome"]["lost_at_end_s"] == pytest.approx(37.0, abs=0.5)
    assert verdict_of(read) == (f"lost for the last {read['outcome']['lost_at_end_s']} s", "bad")
    read["outcome"]["lost_at_end_s"] = 12.0  # low above the horizon
    assert verdict_of(read) == ("tracked through 1 loss", "good")


def test_hours_of_waiting_do_not_drown_the_pass() -> None:
    reading = SeenReading(0.0, 10.0, 20.0, False, False, None, "IDLE", None, None)
    seen = [replace(reading, tai_s=float(at)) for at in range(0, 7200, 60)]
    states = [(0.0, "IDLE"), (1.0, "HOLD/TLE"), (2.0, "IDLE"), (7000.0, "POSITION")]
    shown = PassWatch(readings=seen, states=states, latencies_s=[(1.0, 0.5), (6400.0, 0.1)]).since(6300.0)
    assert [one.tai_s for one in shown.readings] == [float(at) for at in range(6300, 7200, 60)]
    assert shown.states == [(6300.0, "IDLE"), (7000.0, "POSITION")]
    assert shown.latencies_s == [(6400.0, 0.1)]


def test_the_index_takes_reports_alone(tmp_path: Path) -> None:
    (tmp_path / "other.json").write_text("{}")
    (tmp_path / "torn.json").write_text('{"outcome":')
    assert "0 passes" in write_index(tmp_path).read_text()


def test_a_report_of_a_recording_that_replays_otherwise_says_so(tmp_path: Path) -> None:
    path = tmp_path / f"other{SUFFIX}"
    with gzip.open(path_of("latch"), "rt") as file:
        lines = file.read().splitlines()
    k = [i for i, line in enumerate(lines) if line.startswith("X") and len(line) > 40][50]
    lines[k] = lines[k][:-4] + "0000"
    with gzip.open(path, "wt") as file:
        file.write("\n".join(lines) + "\n")
    done = acu_daemon("report", path)
    assert (done.code, "decides otherwise: tick" in done.err) == (1, True)


@pytest.mark.long
@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed")
def test_a_browser_without_a_network_shows_the_page(folder: Path) -> None:
    figures_of("receiver-fault", folder)
    shot = folder / "page.png"
    command = [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--proxy-server=127.0.0.1:1"]
    command += [f"--user-data-dir={folder / 'browser'}", "--window-size=1160,3000", f"--screenshot={shot}"]
    subprocess.run([*command, (folder / "receiver-fault.html").as_uri()], check=True, capture_output=True, timeout=90)
    assert shot.stat().st_size > 50_000  # an empty page has some 10 kB


# Losses


def seen(
    t_s: float,
    is_acquired: bool,
    has_signal: bool | None = None,
    state: str = "HOLD/FITTED",
    agc_db: float | None = None,
) -> SeenReading:
    signal = is_acquired if has_signal is None else has_signal
    return SeenReading(t_s, 10.0, 20.0, signal, is_acquired, agc_db, state, 0.1 * t_s, None)


def test_the_plan_of_the_report_is_the_one_with_which_the_pass_began() -> None:
    first, later = PassPlan(1.0, 2.0, 0.0, 3.0, 4.0), PassPlan(1.5, 2.0, 0.0, 3.0, 4.0)
    watch, state, orders = PassWatch(), ControlState(), Orders(Poll())
    for plan in (None, first, later, None):
        watch.ticked(SimpleNamespace(state=state, sky=Sky(None, None, plan)), 0.0, orders)  # type: ignore[arg-type]
    assert watch.plan is first


def test_a_loss_ends_when_the_signal_is_back_and_relock_is_what_autotrack_took_from_there() -> None:
    before = [seen(0.1 * k, is_acquired=k >= 2) for k in range(10)]
    silent = [seen(1.0 + 0.1 * k, is_acquired=False) for k in range(20)]
    back = [seen(3.0 + 0.1 * k, is_acquired=False, has_signal=True) for k in range(7)]
    again = [seen(3.7, is_acquired=True)]
    (loss,) = losses_of([*before, *silent, *back, *again])
    assert (loss.start_tai_s, loss.length_s, loss.relock_s) == pytest.approx((1.0, 2.0, 0.7))
    assert loss.largest_off_deg == pytest.approx(0.36)
    assert loss.followed == (("HOLD/FITTED", 1.0),)


@pytest.mark.parametrize(("below_db", "is_back"), [(2.9, True), (3.1, False)])
def test_a_signal_is_back_by_a_level_within_3_db_of_autotracks(below_db: float, is_back: bool) -> None:
    before = [seen(0.1 * k, is_acquired=True, agc_db=level_db) for k, level_db in enumerate((9.0, 8.0, 7.0, 8.0))]
    silent = [seen(0.4 + 0.1 * k, is_acquired=False, agc_db=0.0) for k in range(16)]
    level = [seen(2.0 + 0.1 * k, is_acquired=False, agc_db=8.0 - below_db) for k in range(5)]
    (loss,) = losses_of([*before, *silent, *level, seen(2.5, is_acquired=True, agc_db=8.0)])
    assert (loss.length_s, loss.relock_s) == pytest.approx((1.6, 0.5) if is_back else (2.1, 0.0))


def test_one_reading_without_the_bit_is_no_loss_and_one_that_does_not_end_has_no_length() -> None:
    glitch = [seen(0.1 * k, is_acquired=k != 5) for k in range(10)]
    assert losses_of(glitch) == []
    assert losses_of([seen(0.1 * k, is_acquired=False) for k in range(10)]) == []
    (loss,) = losses_of([*glitch, *(seen(1.0 + 0.1 * k, is_acquired=False) for k in range(10))])
    assert (loss.length_s, loss.relock_s) == (None, None)


# Charts


def test_a_curve_is_broken_where_nothing_is_known() -> None:
    curve = ChartLine("a", [0.0, 1.0, 2.0, 3.0, 20.0], [1.0, None, 2.0, 3.0, 4.0], "a")
    drawn = chart("t", "deg", [curve])
    (path,) = re.findall(r'class="line a" d="([^"]*)"', drawn)
    assert path.count("M") == 3


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-0.01, 0.02), (3.0, 3.0), (-500.0, 1e5)])
def test_axes_have_a_few_round_numbers(low: float, high: float) -> None:
    assert len(nice(low, high, 5)) <= 7


def test_a_figure_that_was_never_known_draws_nothing() -> None:
    assert 'd=""' in sparkline("none", [None, None])

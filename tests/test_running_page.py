"""Whether a run has a page, where, and that nothing of the page ends the run."""

import asyncio
from pathlib import Path

import pytest
from structlog.testing import capture_logs
from test_live_line import SEEN

from acu_daemon.cli.page import PageChoice, PageFrame, RunningPage, WatchedRuns, chosen_page, passes_shown
from acu_daemon.config.load import load_station
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.edge.clock import SystemClock
from acu_daemon.errors import UsageError
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.web.feed import Feed
from acu_daemon.web.recent_events import RecentEvents

CONFIG = Path(__file__).resolve().parents[1] / "config"
LOCAL = PageChoice("127.0.0.1", 0, frozenset(), None)


def running(choice: PageChoice | None) -> RunningPage:
    clock = SystemClock()
    watched = WatchedRuns(lambda: None, lambda line, _who: f"ok {line}")
    return RunningPage(PageFrame(choice, RecentEvents(), WriteLease(clock.monotonic_s)), watched, clock)


def station(text: str, folder: Path):
    (folder / "station.toml").write_text((CONFIG / "station.toml").read_text() + text)
    return load_station(folder)


def test_the_option_goes_before_the_file_and_off_is_none(tmp_path: Path) -> None:
    tmp_path.chmod(0o750)
    with_page = station('\n[web]\nlisten = "127.0.0.1:8642"\nnames = ["ACU.lan"]\n', tmp_path)
    assert chosen_page(None, with_page, tmp_path) == PageChoice("127.0.0.1", 8642, frozenset({"acu.lan"}), None)
    assert chosen_page("off", with_page, tmp_path) is None
    chosen = chosen_page("[::1]:0", with_page, tmp_path)
    assert chosen is not None
    assert (chosen.host, chosen.port) == ("::1", 0)
    assert chosen_page(None, load_station(CONFIG), CONFIG) is None
    with pytest.raises(UsageError, match="ADDRESS:PORT in numbers"):
        chosen_page("acu.lan:80", with_page, tmp_path)


def test_a_token_that_others_may_read_refuses_the_start(tmp_path: Path) -> None:
    tmp_path.chmod(0o750)
    found = station('\n[web]\nlisten = "127.0.0.1:8642"\ntoken_file = "token"\n', tmp_path)
    (tmp_path / "token").write_text("0123456789abcdef")
    (tmp_path / "token").chmod(0o640)
    with pytest.raises(UsageError, match="chmod 600"):
        chosen_page(None, found, tmp_path)


async def test_an_error_of_the_page_is_told_once_and_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_feed: Feed, _seen: object) -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(Feed, "see", broken)
    page = running(LOCAL)
    with capture_logs() as said:
        await page.open()
        for _ in range(5):
            page.see(SEEN)
            await asyncio.sleep(0.01)
        await page.close()
    assert [one["event"] for one in said] == ["page.open", "page.failed"]


async def test_a_page_whose_port_is_taken_is_told_and_the_run_goes_on() -> None:
    first = running(LOCAL)
    with capture_logs() as said:
        await first.open()
        port = int(said[0]["url"].rstrip("/").rpartition(":")[2])
        second = running(PageChoice("127.0.0.1", port, frozenset(), None))
        await second.open()
        second.see(SEEN)
        await second.close()
        await first.close()
    assert [one["event"] for one in said] == ["page.open", "page.not_open"]


async def test_a_run_without_a_page_takes_what_it_is_told() -> None:
    page = running(None)
    await page.open()
    page.see(SEEN)
    await page.close()


def test_the_schedule_is_shown_around_now_with_reasons_and_checks() -> None:
    def entry(rise_tai_s: float, number: int) -> Entry:
        times = rise_tai_s, rise_tai_s + 300.0, rise_tai_s + 600.0
        return Entry("noaa-20", *times, 63.2, 5, PassState.PLANNED, "forced by a person", number=number)

    book = [entry(-9000.0, 1), entry(1000.0, 2), entry(2000.0, 3), entry(90000.0, 4)]
    shown = passes_shown(book, lambda one: "elements: too old" if one.number == 2 else None, 0.0)
    assert [(one["no_go"], one["reason"], one["state"]) for one in shown] == [
        ("elements: too old", "forced by a person", "planned"),
        (None, "forced by a person", "planned"),
    ]

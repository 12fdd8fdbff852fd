"""The operator's page in a real Chromium: what a person sees and presses, on a desk, on a phone, with keys alone."""

import asyncio
import hashlib
import hmac
import json
import os
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from chromium import PATIENCE_S, PROGRAM, Tab, chromium
from page_at import TOKEN, PageAt
from script_modules import load
from test_live_line import SEEN

from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.web import order_desk

pass_rig = load("pass_rig")
AXE = Path(__file__).resolve().parents[1] / "build/axe/node_modules/axe-core/axe.min.js"
pytestmark = [
    pytest.mark.realtime,
    pytest.mark.asyncio(loop_scope="module"),
    pytest.mark.skipif(PROGRAM is None, reason="no Chromium here (apt-get install chromium)"),
]
NewTab = Callable[[], Awaitable[Tab]]
SHOWN = "window.acuShown?.tick"
COLOUR = "getComputedStyle(document.querySelector('%s')).color"


class Shown:
    """A page's server that is told a state ten times a second."""

    def __init__(self, page: PageAt) -> None:
        self.page = page
        self.seen: Snapshot = replace(SEEN, arming="armed", tick_count=0)
        self._task: asyncio.Task[None] | None = None
        self._port = 0

    async def start(self) -> None:
        self.page.url = await self.page.server.open("127.0.0.1", self._port)
        self._port = self.page.port
        self._task = asyncio.create_task(self._tell())

    async def _tell(self) -> None:
        while True:
            self.seen = replace(self.seen, tick_count=self.seen.tick_count + 1, tai_s=self.seen.tai_s + 0.1)
            self.page.feed.see(self.seen)
            await asyncio.sleep(0.1)

    async def stop(self) -> None:
        if self._task is not None:
            self._task.cancel()
        await self.page.server.close()

    def change(self, **changes: Any) -> None:
        self.seen = replace(self.seen, **changes)

    @property
    def lines(self) -> list[str]:
        return [line for line, _ in self.page.daemon.asked]


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def browser() -> AsyncIterator[NewTab]:
    async with chromium() as new:
        yield new


@pytest_asyncio.fixture(loop_scope="module")
async def new_tab(browser: NewTab) -> AsyncIterator[NewTab]:
    """Opens tabs, which are closed with the test."""
    tabs: list[Tab] = []

    async def new() -> Tab:
        tabs.append(await browser())
        return tabs[-1]

    yield new
    for tab in tabs:
        await tab.end()


@pytest_asyncio.fixture(loop_scope="module")
async def shown() -> AsyncIterator[Shown]:
    server = Shown(PageAt())
    await server.start()
    yield server
    await server.stop()


async def opened(new_tab: NewTab, shown: Shown, width: int = 1366, height: int = 900) -> Tab:
    tab = await new_tab()
    await tab.size(width, height, is_phone=width < 500)
    await tab.open(shown.page.url)
    await tab.until(SHOWN)
    return tab


async def until(is_so: Callable[[], Any]) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not is_so():
            await asyncio.sleep(0.02)


async def unlock(tab: Tab, name: str = "Ann") -> None:
    for field, text in (("name", name), ("token", TOKEN.decode())):
        await tab.press(f"#{field}")
        await tab.write(text)
    await tab.press("#unlock button[type=submit]")
    await tab.until("!document.querySelector('#verbs').hidden")


async def test_it_says_what_is_asks_nothing_outside_and_complains_of_nothing(new_tab: NewTab, shown: Shown) -> None:
    shown.change(is_rehearsal=True, is_simulation=True)
    tab = await opened(new_tab, shown)
    assert await tab.text("#word") == "TRACKING"
    assert "SIMULATION" in await tab.text("#marks")
    assert "REHEARSAL" in await tab.text("#marks")
    await tab.until("[...document.querySelectorAll('#links li')].every((one) => one.className === 'good')")
    assert {url.split("/")[2] for url in tab.requests} == {f"127.0.0.1:{shown.page.port}"}
    assert tab.said == []


async def test_a_press_of_stop_goes_out_at_once_and_a_page_that_is_loaded_again_sends_none(
    new_tab: NewTab, shown: Shown
) -> None:
    tab = await opened(new_tab, shown)
    await tab.press("#stop")
    await until(lambda: shown.lines)
    assert shown.lines == ["stop"]
    await tab.until("document.querySelector('#stop-said').textContent.includes('sent')")
    shown.change(arming="disarmed", speed_deg_s=0.0, stop_sent_utc="2026-01-01T00:00:01.250Z")
    shown.change(stop_confirmed_utc="2026-01-01T00:00:01.270Z")
    await tab.until("document.querySelector('#stop-said').textContent.includes('the antenna stands')")
    said = await tab.text("#stop-said")
    assert "on the wire 00:00:01.250" in said
    assert "the ACU confirms 00:00:01.270" in said
    shown.change(is_link_up=False, speed_deg_s=None, state="LINK-LOST")
    await tab.until("document.querySelector('#stop-said').textContent.includes('whether it still moves is not known')")
    await tab.value("document.querySelector('#stop').click()")  # no hand: no stop
    await tab.call("Page.reload")
    await tab.until(SHOWN)
    assert shown.lines == ["stop"]


async def test_keys_alone_stop_unlock_and_order(new_tab: NewTab, shown: Shown) -> None:
    tab = await opened(new_tab, shown)
    await tab.key("Tab")
    assert await tab.value("document.activeElement.id") == "stop"
    await tab.key("Enter", "\r")
    await tab.key(" ", " ")
    await until(lambda: len(shown.lines) == 2)
    for _ in range(30):
        await tab.key("Tab")
        if await tab.value("document.activeElement.id") == "name":
            break
    await tab.write("Ann")
    for text in ("alignment", TOKEN.decode()):
        await tab.key("Tab")
        await tab.write(text)
    await tab.key("Enter", "\r")
    await tab.until("!document.querySelector('#verbs').hidden")
    for _ in range(40):
        await tab.key("Tab")
        if await tab.value("document.activeElement.textContent") == "arm":
            break
    await tab.key("Enter", "\r")
    await until(lambda: "arm" in shown.lines)
    assert shown.page.daemon.asked[-1] == ("arm", "Ann by page from 127.0.0.1")


async def test_it_locks_itself_and_tells_others_who_has_the_lease(
    new_tab: NewTab, shown: Shown, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(order_desk, "UNLOCKED_S", 2.0)
    tab, other = await opened(new_tab, shown), await opened(new_tab, shown)
    await unlock(tab)
    await other.until("document.querySelector('#lease').textContent.startsWith('Ann by page')")
    await tab.until("document.querySelector('#verbs').hidden")
    await tab.until("document.querySelector('#lock-state').textContent === 'locked'")
    for field, text in (("name", "Ben"), ("token", TOKEN.decode())):
        await other.press(f"#{field}")
        await other.write(text)
    await other.press("#unlock button[type=submit]")
    await other.until("!document.querySelector('#take-over').hidden")
    assert "the lease is held by Ann" in await other.text("#order-said")
    await other.press("#take-over")
    await tab.until("document.querySelector('#lease').textContent.startsWith('Ben by page')")


async def test_an_alarm_is_seen_by_somebody_and_stands(new_tab: NewTab, shown: Shown) -> None:
    shown.change(encoder_problem="the azimuth encoder is frozen")
    tab = await opened(new_tab, shown)
    await unlock(tab)
    await tab.until("document.querySelector('#alarm-list button')")
    await tab.press("#alarm-list button")
    await tab.until("document.querySelector('#alarm-list .seen')")
    assert "seen by Ann" in await tab.text("#alarm-list")
    shown.change(encoder_problem="")
    await tab.until("document.querySelector('#alarm-list .over')")


async def test_a_connection_that_is_lost_is_said_and_all_is_grey_until_it_is_back(
    new_tab: NewTab, shown: Shown
) -> None:
    shown.change(encoder_problem="the azimuth encoder is frozen")
    tab = await opened(new_tab, shown)
    await tab.until("document.querySelector('#alarm-list .on')")
    await shown.stop()
    await tab.until("document.body.classList.contains('old')")
    for part in ("#word", "#az-m", "#facts dd", "#alarm-list .on", ".strip b"):
        assert await tab.value(COLOUR % part) == await tab.value(COLOUR % "#station"), part
    assert "CONNECTION LOST" in await tab.text("#lost")
    assert await tab.value("document.querySelector('#link-daemon').className") == "bad"
    await tab.press("#stop")
    await tab.until("document.querySelector('#stop-said').textContent.includes('NOT SENT')")
    await shown.start()
    await tab.until("!document.body.classList.contains('old')")
    assert shown.lines == []  # what could not be sent is not sent later
    await shown.stop()


async def test_what_is_not_measured_any_more_is_grey(new_tab: NewTab, shown: Shown) -> None:
    tab = await opened(new_tab, shown)
    shown.change(reading_age_s=3.0)
    await tab.until("document.querySelector('#az-m').classList.contains('old-value')")
    await tab.until("document.querySelector('#link-antenna').className === 'watch'")
    shown.change(is_link_up=False, state="LINK-LOST", link_problem="refused")
    await tab.until("document.querySelector('#link-acu').className === 'bad'")
    assert await tab.text("#word") == "NO LINK"


async def test_a_script_in_a_name_is_only_a_text(new_tab: NewTab, shown: Shown) -> None:
    name = "<img src=x onerror=alert(1)><script>alert(2)</script>"
    shown.change(satellite=name, link_problem=name, elements=name, next_passes=(name,))
    shown.page.events.add({"utc": "", "event": name, "level": "info", "reason": name})
    tab = await opened(new_tab, shown)
    assert await tab.value("document.querySelector('#satellite').textContent") == name
    await tab.until(f"document.querySelector('#event-list').textContent.includes({json.dumps(name)})")
    assert await tab.value("document.querySelectorAll('img, body script').length") == 0
    assert tab.said == []


async def test_a_thousand_events_a_second_and_five_browsers_leave_it_live(new_tab: NewTab, shown: Shown) -> None:
    tabs = [await opened(new_tab, shown) for _ in range(5)]
    for tenth in range(15):
        for number in range(100):
            shown.page.events.add({"utc": "2026-01-01T00:00:00.000Z", "event": "e", "level": "info", "n": number})
        del tenth
        await asyncio.sleep(0.1)
    for tab in tabs:
        await tab.until(f"{SHOWN} >= {shown.seen.tick_count}")
        assert await tab.value("document.querySelectorAll('#event-list li').length") <= 120
    assert f"{len(tabs)} pages open" in await tabs[0].text("#people")


@pytest.mark.parametrize(("width", "height"), [(360, 740), (820, 1100), (1366, 900)])
async def test_it_fits_and_stop_is_in_sight_and_large(new_tab: NewTab, shown: Shown, width: int, height: int) -> None:
    shown.change(encoder_problem="the azimuth encoder is frozen, and this is told at some length", is_rehearsal=True)
    tab = await opened(new_tab, shown, width, height)
    assert await tab.value("document.documentElement.scrollWidth") <= width
    await tab.value("window.scrollTo(0, 1e6)")
    left, top, right, bottom = await tab.value(
        "(() => { const box = document.querySelector('#stop').getBoundingClientRect();"
        "return [box.left, box.top, box.right, box.bottom]; })()"
    )
    assert top >= 0
    assert bottom - top >= 48
    assert right - left >= 48
    assert width - 20 <= right <= width
    height_before = await tab.value("document.querySelector('#links').offsetHeight")
    shown.change(is_link_up=False, state="LINK-LOST", link_problem="tcp://127.0.0.1:3842 is open, but no ACU answers")
    await tab.until("document.querySelector('#link-acu').className === 'bad'")
    assert await tab.value("document.documentElement.scrollWidth") <= width
    assert await tab.value("document.querySelector('#links').offsetHeight") == height_before


@pytest.mark.skipif(not AXE.exists(), reason="no axe-core here (npm install --prefix build/axe axe-core@4.14.1)")
@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.parametrize("width", [360, 1366])
async def test_axe_finds_nothing_serious(new_tab: NewTab, shown: Shown, scheme: str, width: int) -> None:
    shown.change(encoder_problem="the azimuth encoder is frozen", is_rehearsal=True, rejecting="another satellite")
    shown.page.events.add({"utc": "2026-01-01T00:00:00.000Z", "event": "e", "level": "warning", "n": 1})
    tab = await new_tab()
    await tab.scheme(scheme)
    await tab.size(width, 900, is_phone=width < 500)
    await tab.open(shown.page.url)
    await tab.until(SHOWN)
    await unlock(tab)
    await tab.value(AXE.read_text(encoding="utf-8"))
    found = await tab.value("axe.run().then((found) => found.violations.map((one) => [one.id, one.impact,"
                            " one.nodes.map((node) => node.html.slice(0, 120) + node.failureSummary)]))")  # fmt: skip
    assert [one for one in found if one[1] in ("serious", "critical", "moderate")] == []


async def test_its_own_seal_is_the_standard_one(new_tab: NewTab, shown: Shown) -> None:
    tab = await opened(new_tab, shown)
    for length in (0, 1, 55, 56, 63, 64, 65, 200):
        token, text = "k" * (length or 1), "\u00e9" * length
        wanted = hmac.new(token.encode(), text.encode(), hashlib.sha256).hexdigest()
        assert await tab.value(f"hmac({json.dumps(token)}, {json.dumps(text)})") == wanted


async def test_a_real_daemon_is_stopped_from_the_page_frozen_and_killed_under_it(
    new_tab: NewTab, tmp_path: Path
) -> None:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as (rig,):
        rig.start_acu()
        rig.start_daemon("--web", "127.0.0.1:0")
        await until(lambda: rig.log.exists() and rig.events("page.open"))
        tab = await new_tab()
        await tab.open(rig.events("page.open")[0]["url"])
        await tab.until(SHOWN)
        await tab.until("document.querySelector('#word').textContent === 'TRACKING'")
        os.kill(rig.daemon.pid, signal.SIGSTOP)
        await tab.until("!document.querySelector('#lost').hidden")
        os.kill(rig.daemon.pid, signal.SIGCONT)
        await tab.until("document.querySelector('#lost').hidden")
        await tab.press("#stop")
        await tab.until("document.querySelector('#stop-said').textContent.includes('the antenna stands')")
        await tab.until("document.querySelector('#word').textContent === 'DISARMED'")
        asked = rig.events("operator.asked")
        assert [(one["line"], one["who"]) for one in asked] == [("stop", "somebody by page from 127.0.0.1")]
        os.kill(rig.daemon.pid, signal.SIGKILL)
        await tab.until("document.body.classList.contains('old')")
        assert "CONNECTION LOST" in await tab.text("#lost")
        assert tab.said == [] or all("WebSocket" in one for one in tab.said)


OBEYED = (  # what is pressed, what is filled in before, and what is so after it
    ("hold", {}, "now.is_held_by_person && now.state === 'PROGRAM' && now.acu_mode !== 'AUTOTRACK'"),
    ("nudge", {"along_s": "0.5", "across_deg": "-0.1"}, "now.nudge_along_s === 0.5 && now.nudge_across_deg === -0.1"),
    ("track", {}, "!now.is_held_by_person && now.state.startsWith('AUTOTRACK') && now.acu_mode === 'AUTOTRACK'"),
    ("stow", {}, "now.stow_by === 'operator' && now.acu_mode.startsWith('STOW')"),
    ("unstow", {}, "!now.stow_by && now.state.startsWith('AUTOTRACK')"),
    ("skip", {}, "state.schedule[0].state === 'cancelled'"),
    ("pause", {"until": "2026-08-20T06:00:00Z"}, "now.paused_until_utc === '2026-08-20T06:00:00Z'"),
)


async def give(tab: Tab, button: str, comes_true: str) -> None:
    """Press an order's button, on a page that is unlocked again where the last order is long ago."""
    if await tab.value("document.querySelector('#verbs').hidden"):
        await unlock(tab)
    await tab.value("document.querySelector('#order-said').textContent = ''")
    await tab.press(button)
    await tab.until("document.querySelector('#order-said').textContent")
    assert "\u2713" in await tab.text("#order-said")
    await tab.until(comes_true)


async def test_a_real_station_obeys_each_verb_that_is_pressed(new_tab: NewTab, tmp_path: Path) -> None:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 300.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as (rig,):
        rig.start_acu()
        rig.add_page(TOKEN)
        rig.start_station()
        await until(lambda: rig.log.exists() and rig.events("page.open"))
        tab = await new_tab()
        await tab.size(1366, 900)
        await tab.open(rig.events("page.open")[0]["url"])
        await tab.until(SHOWN)
        await tab.until("now.state.startsWith('AUTOTRACK')")
        await unlock(tab)
        await tab.until("state.schedule.some((one) => one.state === 'pass')")  # its row has no button any more
        is_given_up = "state.schedule.some((one) => one.reason.startsWith('excluded'))"
        await give(tab, "#passes button[aria-label^='skip ']", is_given_up)
        await give(tab, "#passes button[aria-label^='unskip ']", f"!{is_given_up}")
        for verb, values, comes_true in OBEYED:
            for name, text in values.items():
                await tab.press(f"#verbs .verb:has(#what-{verb}) [name={name}]")
                await tab.write(text)
            await give(tab, f"#verbs button[aria-describedby=what-{verb}]", comes_true)
        asked = rig.events("operator.asked")
        assert [one["line"].split()[0] for one in asked] == ["skip", "unskip", *(verb for verb, _, _ in OBEYED)]
        assert {one["who"] for one in asked} == {"Ann by page from 127.0.0.1"}
        assert tab.said == []

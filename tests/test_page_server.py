"""What the page's server sends, takes and refuses; whoever attacks it gets nothing, and others are served meanwhile."""

import asyncio
import contextlib
from dataclasses import replace
from typing import Any

import aiohttp
import pytest
from page_at import PATIENCE_S, LivePage, PageAt, live_page, page_at
from test_live_line import SEEN

from acu_daemon.errors import UsageError
from acu_daemon.web import listening, live_side
from acu_daemon.web.feed import Topic
from acu_daemon.web.live_side import AHEAD
from acu_daemon.web.page_server import LARGEST_MESSAGE, MOST_PAGES, page_files

SCRIPT_NAME = "<script>alert(1)</script>"


async def got(page: PageAt, path: str = "", method: str = "GET", **headers: str) -> tuple[int, str]:
    async with aiohttp.ClientSession() as session, session.request(method, page.url + path, headers=headers) as answer:
        return answer.status, await answer.text()


async def raw(page: PageAt, text: bytes) -> bytes:
    """What comes back for bytes; empty: the connection was cut."""
    reader, writer = await asyncio.open_connection("127.0.0.1", page.port)
    try:
        writer.write(text)
        await writer.drain()
        async with asyncio.timeout(PATIENCE_S):
            return await reader.read(65536)
    except ConnectionError:
        return b""
    finally:
        writer.close()


# What is shown


async def test_the_page_is_three_files_that_ask_nothing_from_outside() -> None:
    async with page_at() as page:
        for name in ("", "index.html", "page.css", "page.js", "icon.svg"):
            assert (await got(page, name))[0] == 200
    whole = b"".join(body for body, _ in page_files().values())
    assert len(whole) < 300_000
    outside = whole.replace(b"http://www.w3.org/2000/svg", b"")
    assert b"http://" not in outside
    assert b"https://" not in outside


async def test_every_answer_forbids_what_the_page_does_not_need() -> None:
    async with page_at() as page, aiohttp.ClientSession() as session:
        for name in ("", "nothing"):
            async with session.get(page.url + name) as answer:
                policy = answer.headers["Content-Security-Policy"]
                assert "default-src 'none'" in policy
                assert "script-src 'self'" in policy
                assert "frame-ancestors 'none'" in policy
                assert answer.headers["X-Content-Type-Options"] == "nosniff"


async def test_a_page_sees_the_newest_state_and_what_stands_around_it() -> None:
    async with page_at() as page, live_page(page) as live:
        page.feed.see(replace(SEEN, tick_count=41))
        page.feed.see(replace(SEEN, tick_count=42, satellite=SCRIPT_NAME))
        while live.newest.get("now", {}).get("tick_count") != 42:
            await live.hear()
        assert live.newest["now"]["satellite"] == SCRIPT_NAME  # a text among texts: the page never takes it for markup
        assert live.newest["now"]["level"] == "GOOD"
        assert sum(live.newest["lateness"]["counts"]) == 10
        assert live.newest["people"]["names"] == ["127.0.0.1"]


async def test_a_page_that_takes_nothing_is_sent_two_texts_and_then_the_newest() -> None:
    async with page_at() as page, live_page(page) as live:
        for number in range(100):
            page.feed.see(replace(SEEN, tick_count=number))
            await asyncio.sleep(0)
        ahead = []
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(0.3):
                while True:
                    ahead.append(await live.hear(acknowledges=False))
        assert len(ahead) <= AHEAD
        await live.socket.send_str("a")
        await live.socket.send_str("a")
        while live.newest.get("now", {}).get("tick_count") != 99:
            said = await live.hear()
            assert said.get("now", {"tick_count": 99})["tick_count"] == 99


async def test_while_nobody_looks_nothing_is_made() -> None:
    async with page_at() as page:
        page.feed.see(SEEN)
        assert page.feed.news({})[0] == ""
        async with live_page(page):
            page.feed.see(SEEN)
            assert page.feed.is_watched
        await until(lambda: not page.feed.is_watched)


async def until(is_so: Any) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not is_so():
            await asyncio.sleep(0.01)


async def test_texts_are_made_once_for_all_who_look() -> None:
    page = PageAt()
    page.feed.is_watched = True
    page.feed.see(SEEN)
    first, known = page.feed.news({})
    assert page.feed.news({})[0] is first
    assert page.feed.news(known)[0] == ""
    page.feed.see(replace(SEEN, tick_count=7))
    text, known_then = page.feed.news(known)
    assert text.startswith('"now":')
    assert known_then[Topic.NOW] > known[Topic.NOW]
    assert known_then[Topic.ALARMS] == known[Topic.ALARMS]


# Orders


async def test_stop_needs_neither_token_nor_lease_nor_unlocking() -> None:
    async with page_at() as page, live_page(page) as live:
        await live.socket.send_json({"stop": "s"})
        assert await live.reply() == {"id": "s", "ok": True, "text": page.daemon.asked[0][0]}
        assert page.daemon.asked[0][1] == "somebody by page from 127.0.0.1"


async def test_stop_goes_without_a_live_line_too() -> None:
    async with page_at() as page, aiohttp.ClientSession() as session:
        async with session.post(f"{page.url}stop", json={}, headers={"Origin": page.origin}) as answer:
            assert answer.status == 200
        assert len(page.daemon.asked) == 1


async def test_a_verb_needs_an_unlocked_page_with_the_lease() -> None:
    async with page_at() as page, live_page(page) as live:
        assert "locked" in (await live.order({"do": "verb", "verb": "arm"}))["text"]
        assert (await live.unlock())["unlocked_s"] == 30.0
        assert (await live.order({"do": "verb", "verb": "arm"}))["ok"]
        assert not (await live.order({"do": "verb", "verb": "clear"}))["ok"]
        assert page.daemon.asked == [(line, "Ann by page from 127.0.0.1") for line in ("arm", "clear")]
        assert (await live.order({"do": "lock"}))["ok"]
        assert page.lease.held is None
        assert "locked" in (await live.order({"do": "verb", "verb": "arm"}))["text"]


async def test_the_lease_is_one_and_may_be_taken_over_by_who_says_so() -> None:
    async with page_at() as page, live_page(page) as ann, live_page(page) as ben:
        await ann.unlock()
        refused = await ben.unlock("Ben")
        assert refused["is_held"]
        assert "held by Ann by page, test" in refused["text"]
        assert (await ben.unlock("Ben", takes_over=True))["ok"]
        assert "somebody else has the lease" in (await ann.order({"do": "verb", "verb": "arm"}))["text"]
        assert page.daemon.asked == []


async def test_an_alarm_is_acknowledged_by_name_and_stays() -> None:
    async with page_at() as page, live_page(page) as live:
        page.feed.see(replace(SEEN, latch="azimuth stands still"))
        while not live.newest.get("alarms"):
            await live.hear()
        number = live.newest["alarms"][0]["number"]
        await live.unlock()
        assert "unknown" in (await live.order({"do": "acknowledge", "number": True}))["text"]
        assert (await live.order({"do": "acknowledge", "number": number}))["ok"]
        while not live.newest["alarms"][0]["acknowledged_by"]:
            await live.hear()
        assert live.newest["alarms"][0]["ended_utc"] == ""


async def test_a_page_without_a_token_shows_and_stops() -> None:
    async with page_at(token=None) as page, live_page(page) as live:
        assert live.newest["hello"]["may_order"] is False
        assert "only looks" in (await live.unlock())["text"]
        await live.socket.send_json({"stop": 1})
        assert (await live.reply())["ok"]


# Attacks


async def served(page: PageAt) -> None:
    """An honest page is served, and nobody has ordered anything."""
    assert (await got(page))[0] == 200
    assert page.daemon.asked == []


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8642", "127.0.0.1.evil.example"])
async def test_a_name_that_was_rebound_is_refused(host: str) -> None:
    async with page_at() as page:
        for path, method in (("", "GET"), ("live", "GET"), ("stop", "POST")):
            assert (await got(page, path, method, Host=host, Origin=f"http://{host}"))[0] == 421
        await served(page)


async def test_another_site_is_refused() -> None:
    async with page_at() as page:
        for origin in ("http://evil.example", "null", f"http://127.0.0.1:{page.port + 1}"):
            for path, method in (("live", "GET"), ("stop", "POST")):
                assert (await got(page, path, method, Origin=origin))[0] == 403
        assert (await got(page, "stop", "POST"))[0] == 403
        form = {"Origin": page.origin, "Content-Type": "text/plain"}  # what a form of another site could send
        assert (await got(page, "stop", "POST", **form))[0] == 403
        await served(page)


WRONG = b"another token 16"


async def test_an_order_without_the_token_or_with_a_wrong_one_is_refused() -> None:
    async with page_at() as page, live_page(page) as live:
        await live.socket.send_json({"order": '{"n":1,"do":"verb","verb":"arm"}'})
        assert not (await live.reply())["ok"]
        assert (await live.order({"do": "verb", "verb": "arm"}, token=WRONG))["text"] == "the token is wrong"
        await served(page)


async def test_who_guesses_tokens_is_cut_off_and_whoever_has_it_is_not() -> None:
    async with page_at() as page, live_page(page) as honest:
        with pytest.raises(ConnectionError):
            async with live_page(page) as live:
                for _ in range(30):
                    await live.order({"do": "unlock", "name": "x"}, token=WRONG)
        assert (await honest.unlock())["ok"]


async def test_an_order_that_was_overheard_is_not_taken_again() -> None:
    async with page_at() as page, live_page(page) as live, live_page(page) as other:
        await live.unlock()
        heard = live.sealed({"do": "verb", "verb": "arm"})
        await live.socket.send_str(heard)
        assert (await live.reply())["ok"]
        for again in (live, other):
            await again.socket.send_str(heard)
            assert not (await again.reply())["ok"]
        assert len(page.daemon.asked) == 1


@pytest.mark.parametrize(
    "path",
    [
        "../../etc/passwd",
        "..%2f..%2fetc%2fpasswd",
        "%2e%2e/station.toml",
        "page/../../guard.py",
        "guard.py",
        "page.css/",
        "\\x",
    ],
)
async def test_no_path_leads_to_another_file(path: str) -> None:
    async with page_at() as page:
        answer = await raw(page, f"GET /{path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        assert answer.split(b" ")[1] in (b"404", b"400", b"403")
        await served(page)


async def test_what_is_too_large_is_refused() -> None:
    async with page_at() as page:
        long = b"x" * 20_000
        for text in (b"GET /" + long, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + long, long):
            assert b" 200 " not in (await raw(page, text + b"\r\n\r\n"))[:20]
        head = f"POST /stop HTTP/1.1\r\nHost: {page.origin[7:]}\r\nOrigin: {page.origin}\r\n"
        head += "Content-Type: application/json\r\n"
        answer = await raw(page, f"{head}Content-Length: 900000000\r\n\r\n".encode() + long)
        assert len(answer) < 4096
        async with live_page(page) as live:
            await live.socket.send_str("x" * (LARGEST_MESSAGE + 1))
            with pytest.raises(ConnectionError):
                while True:
                    await live.hear()
        page.daemon.asked.clear()
        await served(page)


@pytest.mark.parametrize("text", ["no json", "[]", "1"])
async def test_a_page_that_talks_nonsense_is_cut_off(text: str) -> None:
    async with page_at() as page, live_page(page) as live:
        await live.socket.send_str(text)
        with pytest.raises(ConnectionError):
            while True:
                await live.hear()
        await served(page)


async def test_a_flood_of_messages_cuts_off_who_sends_it() -> None:
    async with page_at() as page, live_page(page) as other:
        with pytest.raises((ConnectionError, aiohttp.ClientError)):
            async with live_page(page) as live:
                for _ in range(2000):
                    await live.socket.send_str("a")
                while True:
                    await live.hear(acknowledges=False)
        assert (await other.unlock())["ok"]


async def test_a_flood_of_stops_is_obeyed_and_then_cut_off() -> None:
    async with page_at() as page, live_page(page) as live:
        with pytest.raises((ConnectionError, aiohttp.ClientError)):
            for number in range(100):
                await live.socket.send_json({"stop": number})
            while True:
                await live.hear()
        assert 20 <= len(page.daemon.asked) <= 30
        assert {line for line, _ in page.daemon.asked} == {"stop"}


async def test_slow_requests_are_ended_and_others_served_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listening, "PATIENCE_S", 0.5)
    async with page_at() as page:
        slow = [await asyncio.open_connection("127.0.0.1", page.port) for _ in range(60)]
        for _, writer in slow:
            writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-")
        await served(page)
        for reader, writer in slow:
            with contextlib.suppress(ConnectionError):
                async with asyncio.timeout(PATIENCE_S):
                    assert await reader.read() == b""
            writer.close()


async def test_no_more_pages_than_there_is_room_for() -> None:
    async with page_at() as page, contextlib.AsyncExitStack() as pages:
        opened = 0
        with pytest.raises(aiohttp.WSServerHandshakeError):
            for _ in range(MOST_PAGES + 1):
                await pages.enter_async_context(live_page(page))
                opened += 1
        assert opened == MOST_PAGES


async def test_a_page_that_reads_nothing_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_side, "SILENT_S", 0.3)
    async with page_at() as page, live_page(page) as live:
        with pytest.raises(ConnectionError):
            for _ in range(1000):
                await live.hear(acknowledges=False)


async def test_a_port_that_is_taken_says_what_to_do() -> None:
    async with page_at() as page:
        other = PageAt()
        with pytest.raises(UsageError, match="another program has it"):
            await other.server.open("127.0.0.1", page.port)
        await other.server.close()
        with pytest.raises(UsageError, match="numbers"):
            await other.server.open("no.such.host.example", 0)
        await other.server.close()


async def test_what_a_page_is_told_of_itself() -> None:
    async with page_at() as page, live_page(page) as live:
        verbs = {one["name"] for one in live.newest["hello"]["verbs"]}
        assert verbs >= {"arm", "disarm", "clear"}
        assert isinstance(live, LivePage)

#!/usr/bin/env python3
"""Bench the operator's page: a real daemon in a pass, a real Chromium and five light pages, on one machine.

What it does
  Flies the demo's pass on a simulated ACU, the page served, and measures: how soon the page is painted and shows a
  state; how old a state is when it is drawn; from a press of STOP to STOP on the wire; and how late the ticks come, in
  turns of some seconds with nobody looking, with Chromium and five light pages, and attacked: slow requests, requests
  of another site, guessed tokens and nonsense, as fast as it lets them in.  So what else the machine does is in all.

Prints a Markdown table, asked and measured.

Exit status: 0 all asked figures are met; 1 at least one is not; 2 the bench itself could not run.

Examples
  scripts/bench_page.py                              twelve turns of 10 s each
  scripts/bench_page.py --turns 4 --seconds 5 --stops 3
"""

# ruff: noqa: ASYNC110  (what is waited for is in other processes)

import argparse
import asyncio
import contextlib
import json
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
from chromium import PROGRAM, Tab, chromium
from pass_rig import Rig, make_scene, rigs

from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.web.page_server import page_files

WINDOW_S = 600.0
LIGHT_COUNT = 5
ALONE, WATCHED, ATTACKED = "nobody looks", f"Chromium and {LIGHT_COUNT} light pages", "Chromium, and attacked"
NOTE_PRESS = """(() => {
const button = document.querySelector("#stop");
button.onpointerdown = (event) => { window.pressed = performance.timeOrigin + event.timeStamp; };
})()"""
WATCH = """
window.acuAges = [];
(function look(last) {
    const shown = window.acuShown;
    if (shown && shown.tick !== last) acuAges.push([shown.tai_s, performance.timeOrigin + shown.drawn]);
    requestAnimationFrame(() => look(shown?.tick));
})();
"""


async def main() -> int:
    """Run the bench as the command line asks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=12, metavar="N")
    parser.add_argument("--seconds", type=float, default=10.0, metavar="S", help="of a turn")
    parser.add_argument("--stops", type=int, default=10, metavar="N")
    asked = parser.parse_args()
    if PROGRAM is None:
        print("no Chromium here: apt-get install chromium", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(prefix="bench-page-") as folder:
        scene = make_scene(Path(folder) / "scene", None, WINDOW_S)
        with rigs(scene, ["tcp"], Path(folder)) as (rig,):
            rig.start_acu()
            rig.start_daemon("--web", "127.0.0.1:0", "--log-level", "debug")
            async with chromium() as new_tab:
                url = await until(lambda: rig.events("page.open") if rig.log.exists() else [])
                await until(lambda: rig.state == "AUTOTRACK/FITTED")
                page = url[0]["url"]
                rows = await first_sight(await new_tab(), page, rig)
                rows += await ticks(new_tab, page, rig, asked.turns, asked.seconds)
                rows += await stops(await new_tab(), page, rig, asked.stops)
    weight = sum(len(body) for name, (body, _) in page_files().items() if not name.endswith(".svg"))
    rows.append(("weight of the page, kB", weight / 1e3, 300.0))
    print("| what | measured | asked |\n|---|---|---|")
    for what, value, most in rows:
        print(f"| {what} | {value:.3g} | {'' if most is None else f'<= {most:g}'} |")
    return int(any(most is not None and value > most for _, value, most in rows))


Row = tuple[str, float, float | None]


async def until(found: Any) -> Any:
    async with asyncio.timeout(120.0):
        while not (result := found()):
            await asyncio.sleep(0.05)
    return result


def age_of(rig: Rig, tai_s: float, wall_ms: float) -> float:
    """Milliseconds from an instant of the daemon's clock to one of the browser's."""
    monotonic_s = rig.at_monotonic_s + tai_s - rig.scene.start_tai_s
    return wall_ms - 1e3 * (monotonic_s + time.time() - time.monotonic())


async def first_sight(tab: Tab, page: str, rig: Rig) -> list[Row]:
    await tab.size(1366, 900)
    await tab.open(page)
    await tab.until("window.acuShown")
    painted_ms = await tab.value("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    shown_ms = await tab.value("window.acuShown.drawn")
    await tab.value(WATCH)
    await asyncio.sleep(10.0)
    ages = [age_of(rig, *one) for one in await tab.value("acuAges")]
    outside = [url for url in tab.requests if url.split("/")[2] != page.split("/")[2]]
    await tab.end()
    return [
        ("first paint, ms", painted_ms, 1000.0),
        ("first state drawn, ms", shown_ms, None),
        ("age of a state when it is drawn, 50 %, ms", float(np.percentile(ages, 50)), None),
        ("99 %, ms", float(np.percentile(ages, 99)), 300.0),
        ("requests to the outside", float(len(outside)), 0.0),
    ]


@contextlib.asynccontextmanager
async def light_pages(page: str) -> AsyncIterator[None]:
    async def look(session: aiohttp.ClientSession) -> None:
        async with session.ws_connect(f"{page}live", headers={"Origin": page.rstrip("/")}) as socket:
            async for _ in socket:
                await socket.send_str("a")

    async with aiohttp.ClientSession() as session:
        looking = [asyncio.create_task(look(session)) for _ in range(LIGHT_COUNT)]
        try:
            yield
        finally:
            for one in looking:
                one.cancel()
            await asyncio.gather(*looking, return_exceptions=True)


@contextlib.asynccontextmanager
async def attack(page: str) -> AsyncIterator[None]:
    port = int(page.rstrip("/").rpartition(":")[2])

    async def slow() -> None:
        while True:
            with contextlib.suppress(OSError):
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.write(b"GET / HTTP/1.1\r\nX-")
                await reader.read()
                writer.close()

    async def foreign() -> None:
        while True:
            with contextlib.suppress(OSError, aiohttp.ClientError):
                async with aiohttp.ClientSession() as session:
                    await session.post(f"{page}stop", json={}, headers={"Origin": "http://evil.example"})

    async def guess() -> None:
        while True:
            with contextlib.suppress(OSError, aiohttp.ClientError):
                async with (
                    aiohttp.ClientSession() as session,
                    session.ws_connect(f"{page}live", headers={"Origin": page.rstrip("/")}) as socket,
                ):
                    while not socket.closed:
                        await socket.send_json({"order": '{"n":1}', "seal": "0"})
                        await socket.receive()

    attacking = [asyncio.create_task(one()) for one in (*[slow] * 30, *[foreign] * 4, *[guess] * 4)]
    try:
        yield
    finally:
        for one in attacking:
            one.cancel()
        await asyncio.gather(*attacking, return_exceptions=True)


async def ticks(new_tab: Any, page: str, rig: Rig, turns: int, seconds: float) -> list[Row]:
    late: dict[str, list[float]] = {ALONE: [], WATCHED: [], ATTACKED: []}
    for turn in range(turns):
        kind = list(late)[turn % 3]
        if kind == ALONE:
            late[kind] += await late_ms(rig, seconds)
            continue
        tab = await new_tab()
        await tab.open(page)
        await tab.until("window.acuShown")
        async with light_pages(page) if kind == WATCHED else attack(page):
            await asyncio.sleep(1.0)
            late[kind] += await late_ms(rig, seconds)
        await tab.end()
    rows: list[Row] = []
    for share, most in ((50, None), (99, 2.0)):
        for kind, values in late.items():
            rows.append(
                (f"ticks late {share} %, {kind}, ms", percentile(values, share), None if kind == ALONE else most)
            )
    alone = percentile(late[ALONE], 99)
    return [
        *rows,
        *((f"ratio of the 99 %, {kind}", percentile(late[kind], 99) / alone, None) for kind in (WATCHED, ATTACKED)),
    ]


def percentile(values: Sequence[float], share: float) -> float:
    return float(np.percentile(values, share))


async def late_ms(rig: Rig, seconds: float) -> list[float]:
    """How late the ticks of the coming seconds are, by the daemon's log."""
    begin = rig.log.stat().st_size
    await asyncio.sleep(seconds)
    with rig.log.open() as log:
        log.seek(begin)
        lines = log.read().splitlines()[1:-1]
    found = [json.loads(line) for line in lines if '"tick"' in line]
    return [one["late_ms"] for one in found if one["event"] == "tick"]


async def stops(tab: Tab, page: str, rig: Rig, count: int) -> list[Row]:
    """Press STOP, arm again, and so on; by the daemon's own time of the write."""
    await tab.size(1366, 900)
    await tab.open(page)
    await tab.until("window.acuShown")
    took_ms = []
    for _ in range(count):
        await tab.value(NOTE_PRESS)
        before = await tab.value("now.stop_sent_utc")
        await tab.press("#stop")
        await tab.until(f"now.stop_confirmed_utc && now.stop_sent_utc !== {json.dumps(before)}")
        sent_tai_s = tai_from_utc(await tab.value("now.stop_sent_utc"))
        took_ms.append(-age_of(rig, sent_tai_s, await tab.value("window.pressed")))
        said = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "acu_daemon", "arm", "--state", str(rig.directory / "state"), "--rehearsal",
            stdout=asyncio.subprocess.DEVNULL,
        )  # fmt: skip
        await said.wait()
        await tab.until("now.state.startsWith('AUTOTRACK') || now.state.startsWith('HOLD')")
    return [
        ("press of STOP to STOP on the wire, 50 %, ms", percentile(took_ms, 50), None),
        ("the longest, ms", max(took_ms), 200.0),
    ]


if __name__ == "__main__":
    sys.exit(asyncio.run(main()))

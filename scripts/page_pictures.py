#!/usr/bin/env python3
"""Draws the pictures of docs/page.md: the demo's pass flown on a simulated ACU, its page seen by a real Chromium.

It is flown twice: with a signal that is lost at times, and far off its elements, so that it is searched for.
Writes docs/pictures/page-*.png.  Takes five minutes.
"""

# ruff: noqa: ASYNC110  (what is waited for is in other processes)

import asyncio
import contextlib
import io
import sys
import tempfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path

from chromium import PROGRAM, Tab, chromium
from pass_rig import Rig, make_scene, rigs
from PIL import Image

from acu_daemon.orbit.timescales import utc_text

PICTURES = Path(__file__).resolve().parents[1] / "docs" / "pictures"
COLOURS = 255
LOSSES_S = ((60.0, 75.0), (120.0, 140.0), (175.0, 240.0))  # of the signal, after the start
FAR_OFF = (  # of a search's satellite, so that it is beside the first row; in place of the demo's
    ("along_track_s = 0.9", "along_track_s = 12.0"),
    ("delta_raan_deg = 0.015", "delta_raan_deg = 0.3"),
)
AROUND = """
[envelope]
mask = [[0, 12], [60, 6], [110, 28], [150, 6], [230, 8], [280, 22], [330, 8]]
sun_policy = "avoid"
sun_keep_out_deg = 8.0
[[envelope.keep_out]]
name = "the mast"
az_from_deg = 200.0
az_to_deg = 240.0
el_to_deg = 50.0
"""
TOKEN = "0123456789abcdef"


async def main() -> int:
    """Fly, look, and write what was seen."""
    if PROGRAM is None:
        print("no Chromium here: apt-get install chromium", file=sys.stderr)
        return 2
    async with watched_pass(400.0, with_losses) as tab:
        await look(tab)
    async with watched_pass(400.0, far_off) as tab:
        await look_at_search(tab)
    return 0


def with_losses(rig: Rig) -> None:
    with (rig.config / "scenario.toml").open("a") as scenario:
        for begin_s, end_s in LOSSES_S:
            from_utc, to_utc = (utc_text(rig.scene.start_tai_s + at_s, 0) for at_s in (begin_s, end_s))
            scenario.write(f'\n[[loss]]\ncause = "silence-zone"\nfrom_utc = {from_utc}\nto_utc = {to_utc}\n')


def far_off(rig: Rig) -> None:
    scenario, station = rig.config / "scenario.toml", rig.config / "station.toml"
    text = scenario.read_text()
    for of_the_demo, far in FAR_OFF:
        text = text.replace(of_the_demo, far)
    scenario.write_text(text)
    station.write_text(station.read_text() + AROUND)


@contextlib.asynccontextmanager
async def watched_pass(window_s: float, prepare: Callable[[Rig], None]) -> AsyncIterator[Tab]:
    """A real daemon in the demo's pass, and a tab that shows its page."""
    with tempfile.TemporaryDirectory(prefix="page-pictures-") as folder:
        scene = make_scene(Path(folder) / "scene", None, window_s)
        with rigs(scene, ["tcp"], Path(folder)) as (rig,):
            prepare(rig)
            rig.start_acu()
            rig.add_page(TOKEN.encode())
            rig.start_daemon()
            async with chromium() as new_tab:
                while not (rig.log.exists() and rig.events("page.open")):
                    await asyncio.sleep(0.1)
                tab = await new_tab()
                await tab.scheme("dark")
                await tab.size(1366, 1130)
                await tab.open(rig.events("page.open")[0]["url"])
                await tab.until("window.acuShown")
                yield tab


async def look_at_search(tab: Tab) -> None:
    await tab.size(1366, 900)
    await tab.until("now.state === 'SEARCH' && state.ahead?.searched.length >= 2")
    await save(tab, "page-search")


async def look(tab: Tab) -> None:
    for second in range(40, 200, 40):  # until the strips are worth looking at
        await tab.until(f"strip.length > {second}")
    await tab.until("now.state === 'HOLD/FITTED' && now.state_s > 8")
    await save(tab, "page-desk")
    await tab.size(360, 780, is_phone=True)
    await tab.until("innerWidth === 360")
    await save(tab, "page-phone")
    await tab.size(1366, 640)
    await tab.value("theme('night')")
    for field, text in (("name", "Ann"), ("reason", "alignment"), ("token", TOKEN)):
        await tab.press(f"#{field}")
        await tab.write(text)
    await tab.press("#unlock button[type=submit]")
    await tab.until("!document.querySelector('#verbs').hidden")
    await tab.press("#stop")
    await tab.until("document.querySelector('#stop-said').textContent.includes('stands')")
    await tab.value("scrollTo(0, 0)")
    await save(tab, "page-night")


async def save(tab: Tab, name: str) -> None:
    await asyncio.sleep(0.5)
    path = PICTURES / f"{name}.png"
    await tab.picture(path)
    whole = Image.open(io.BytesIO(path.read_bytes())).convert("RGB")
    whole.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    sys.exit(asyncio.run(main()))

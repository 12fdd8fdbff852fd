#!/usr/bin/env python3
"""Draws the pictures of docs/page.md: the demo's pass flown on a simulated ACU, its page seen by a real Chromium.

Writes docs/pictures/page-*.png.  Takes four minutes.
"""

# ruff: noqa: ASYNC110  (what is waited for is in other processes)

import asyncio
import io
import sys
import tempfile
from pathlib import Path

from chromium import PROGRAM, Tab, chromium
from pass_rig import make_scene, rigs
from PIL import Image

from acu_daemon.orbit.timescales import utc_text

PICTURES = Path(__file__).resolve().parents[1] / "docs" / "pictures"
COLOURS = 255
LOSSES_S = ((60.0, 75.0), (120.0, 140.0), (175.0, 240.0))  # of the signal, after the start
TOKEN = "0123456789abcdef"


async def main() -> int:
    """Fly, look, and write what was seen."""
    if PROGRAM is None:
        print("no Chromium here: apt-get install chromium", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(prefix="page-pictures-") as folder:
        scene = make_scene(Path(folder) / "scene", None, 400.0)
        with rigs(scene, ["tcp"], Path(folder)) as (rig,):
            with (rig.config / "scenario.toml").open("a") as scenario:
                for begin_s, end_s in LOSSES_S:
                    from_utc, to_utc = (utc_text(scene.start_tai_s + at_s, 0) for at_s in (begin_s, end_s))
                    scenario.write(f'\n[[loss]]\ncause = "silence-zone"\nfrom_utc = {from_utc}\nto_utc = {to_utc}\n')
            rig.start_acu()
            token = rig.config / "token"
            token.touch(mode=0o600)
            token.write_text(TOKEN)
            station = rig.config / "station.toml"
            station.write_text(station.read_text() + '\n[web]\nlisten = "127.0.0.1:0"\ntoken_file = "token"\n')
            rig.start_daemon()
            async with chromium() as new_tab:
                while not (rig.log.exists() and rig.events("page.open")):
                    await asyncio.sleep(0.1)
                desk = await new_tab()
                await desk.scheme("dark")
                await desk.size(1366, 1130)
                await desk.open(rig.events("page.open")[0]["url"])
                await look(desk)
    return 0


async def look(tab: Tab) -> None:
    await tab.until("window.acuShown")
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

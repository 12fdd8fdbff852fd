"""Whether ticks notice that metrics are read: lateness without and with 50 scrapes a second, in turns, in one daemon.

    scripts/metrics_figures.py [TURNS] [SECONDS]

Prints p99 of each turn and the median ratio of neighbouring turns.
"""

import asyncio
import statistics
import sys
import tempfile
import time
from math import isinf
from pathlib import Path
from typing import Any

import aiohttp
import pass_rig

SCRAPES_PER_S = 50.0


def buckets(page: str) -> dict[float, float]:
    """Cumulated counts of the lateness by bound."""
    name = 'acu_tick_lateness_seconds_bucket{le="'
    lines = [line.removeprefix(name).split('"} ') for line in page.splitlines() if line.startswith(name)]
    return {float(bound): float(count) for bound, count in lines}


def p99_ms(before: dict[float, float], after: dict[float, float]) -> float:
    """As Prometheus reckons it: linear within a bucket, and in the one without an end its beginning."""
    counts = {bound: after[bound] - before[bound] for bound in after}
    rank, low_s, low_count = 0.99 * max(counts.values()), 0.0, 0.0
    for bound_s, count in sorted(counts.items()):
        if count >= rank:
            share = (rank - low_count) / max(count - low_count, 1e-9)
            return 1e3 * (low_s if isinf(bound_s) else low_s + share * (bound_s - low_s))
        low_s, low_count = bound_s, count
    return 0.0


async def measure(url: str, turns: int, seconds: float) -> list[tuple[float, float]]:
    """p99 of the lateness, ms, of each pair of turns: without scrapes, with them."""
    async with aiohttp.ClientSession() as session:

        async def page() -> str:
            async with session.get(url) as reply:
                return await reply.text()

        async def turn(rate: float) -> float:
            before = buckets(await page())
            end_s, tasks = time.monotonic() + seconds, []
            while time.monotonic() < end_s:
                if rate:
                    tasks.append(asyncio.create_task(page()))
                await asyncio.sleep(1.0 / rate if rate else 0.5)
            await asyncio.gather(*tasks)
            await asyncio.sleep(1.0)
            return p99_ms(before, buckets(await page()))

        return [(await turn(0.0), await turn(SCRAPES_PER_S)) for _ in range(turns)]


def main(turns: int = 6, seconds: float = 15.0) -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        scene = pass_rig.make_scene(directory / "scene", None, 400.0)
        with pass_rig.rigs(scene, ["tcp"], directory) as [rig]:
            rig.start_acu()
            station = rig.config / "station.toml"
            station.write_text(station.read_text() + '\n[metrics]\nlisten = "127.0.0.1:0"\n')
            rig.start_daemon()
            opened: list[dict[str, Any]] = []
            while not opened or rig.state != "AUTOTRACK/FITTED":
                time.sleep(0.2)
                opened = rig.events("metrics.open")
            pairs = asyncio.run(measure(opened[0]["url"], turns, seconds))
    for without, with_them in pairs:
        print(f"p99 {without:7.3f} ms without, {with_them:7.3f} ms with {SCRAPES_PER_S:g} scrapes a second")
    ratios = [with_them / without for without, with_them in pairs]
    print(f"ratio: median {statistics.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}")


if __name__ == "__main__":
    main(*(kind(text) for kind, text in zip((int, float), sys.argv[1:], strict=False)))

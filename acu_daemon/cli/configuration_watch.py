"""Whether a file that the station was made from has changed: station.toml, satellites' files, their elements."""

import contextlib
import math
from collections.abc import Collection
from pathlib import Path

from acu_daemon.cli.options import Target
from acu_daemon.edge.elements_choice import ElementsSources

EVERY_S = 5.0


class ConfigurationWatch:
    """Looks at times, sizes and inodes of the files, never into them."""

    def __init__(self, config: Path) -> None:
        self._config = config
        self._stamp: dict[str, tuple[int, ...]] = {}
        self._looked_tai_s = -math.inf

    def look(self, now_tai_s: float, targets: Collection[Target]) -> str:
        """What has changed since the last look; empty: nothing, or it is not time to look again."""
        if 0.0 <= now_tai_s - self._looked_tai_s < EVERY_S:
            return ""
        self._looked_tai_s = now_tai_s
        before, self._stamp = self._stamp, _stamp(self._config, targets)
        if changed := [path for path, one in self._stamp.items() if before.get(path, one) != one]:
            return f"changed: {', '.join(changed)}"
        return "a file has gone" if len(self._stamp) < len(before) else ""


def _stamp(config: Path, targets: Collection[Target]) -> dict[str, tuple[int, ...]]:
    """What changes when a file does, by its name."""
    paths = [config / "station.toml", *sorted((config / "satellites").glob("*.toml"))]
    names = (getattr(target.satellite.elements, "file", "") for target in targets)
    paths += [config / "satellites" / name for name in names if name]
    for target in targets:
        sources, norad_id = ElementsSources.of(config, target.station.elements), target.satellite.satellite.norad_id
        if sources is not None and norad_id is not None:
            paths += sources.files(norad_id)
    found: dict[str, tuple[int, ...]] = {}
    for path in paths:
        with contextlib.suppress(OSError):
            stat = path.stat()
            found[path.name] = (stat.st_mtime_ns, stat.st_size, stat.st_ino)
    return found

"""New elements moved into place while the daemon waits for a pass: read, judged, and taken unless they are worse."""

import asyncio
import contextlib
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.cli.options import Target, coming_pass, last_fit
from acu_daemon.config.load import load_satellite, load_station
from acu_daemon.config.satellite_tables import ElementsFileSection, SatelliteFile
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.elements_choice import ElementsSources, choose_elements
from acu_daemon.edge.elements_store import confirm_doubtful
from acu_daemon.errors import AcuDaemonError, ElementsError
from acu_daemon.model import Pass
from acu_daemon.orbit.propagator import is_ephemeris, spans_tai_s
from acu_daemon.orbit.set_judgement import Judged, judge
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text

STILL_BEST = "those in force are still the best for the coming pass"
SOURCE_LOOKS = 10  # a directory may hold many files
Stamp = tuple[tuple[str, int, int, int], ...]  # of each file: its name, time of change, size, number


class ElementsWatch:
    """Looks once a second whether a file has changed, and reads it beside the loop.  Owned by the daemon's loop.

    Only the elements and their [uncertainty] are read again: everything else of the files stays as at the start.
    """

    def __init__(self, config: Path, name: str, target: Target, clock: Clock, folders: tuple[Path, ...] = ()) -> None:
        """folders: of the antenna's state, in which the last pass's fit is."""
        self._config, self._name, self._clock, self._folders = config, name, clock, folders
        self.target = target  # what is in force
        self._look_count = 0
        self._sources_stamp = _stamps(self._sources(target.satellite))
        self._stamp = self._look_at(target.satellite)
        self._contents = self._read(target.satellite)
        self._reading: asyncio.Task[tuple[bytes, Target | str]] | None = None
        self._log: Any = structlog.get_logger("elements")

    def look(self, coming: Pass) -> bool:
        """Look at the files; True: other elements are in `target` from now on, and the pass has to be planned anew."""
        if self._reading is None:
            if self._look_count % SOURCE_LOOKS == 0:
                self._sources_stamp = _stamps(self._sources(self.target.satellite))
            self._look_count += 1
            stamp = self._look_at(self.target.satellite)
            if stamp != self._stamp:
                self._stamp = stamp
                self._reading = asyncio.get_running_loop().create_task(self._read_again(coming), name="elements")
            return False
        if not self._reading.done():
            return False
        done, self._reading = self._reading, None
        contents, found = done.result()
        if contents == self._contents:
            return False
        self._contents = contents
        return self._take(found)

    def _take(self, found: Target | str) -> bool:
        if found == STILL_BEST:
            return False
        if isinstance(found, str):
            self._log.warning("elements.kept", reason=found, in_force=utc_text(self.target.elements.epoch_tai_s, 0))
            return False
        before, self.target = self.target.elements, found
        self._log.info(
            "elements.taken",
            satellite=found.elements.label,
            kind=found.elements.propagator.kind,
            epoch=utc_text(found.elements.epoch_tai_s, 0),
            before=utc_text(before.epoch_tai_s, 0),
        )
        for warning in found.elements.warnings:
            self._log.warning("elements.warning", reason=warning)
        return True

    async def _read_again(self, coming: Pass) -> tuple[bytes, Target | str]:
        contents = self._read(self.target.satellite)  # what comes after this is looked at again
        judge = partial(read_again, self._config, self._name, self.target, coming, self._clock.tai_s(), self._folders)
        try:
            found = await asyncio.to_thread(judge)
        except RuntimeError:  # the system denies a thread: the antenna waits, and so may the loop
            found = judge()
        return contents, found

    def _files(self, satellite: SatelliteFile) -> list[Path]:
        toml, section = self._config / "satellites" / f"{self._name}.toml", satellite.elements
        return [toml, toml.parent / section.file] if isinstance(section, ElementsFileSection) else [toml]

    def _sources(self, satellite: SatelliteFile) -> list[Path]:
        """The files of the station's sources, which may be large: they are known by their stamps alone."""
        norad_id = satellite.satellite.norad_id
        sources = ElementsSources.of(self._config, self.target.station.elements)
        return [] if sources is None or norad_id is None else sources.files(norad_id)

    def _look_at(self, satellite: SatelliteFile) -> Stamp:
        return (*_stamps(self._files(satellite)), *self._sources_stamp)

    def _read(self, satellite: SatelliteFile) -> bytes:
        contents = b""
        for path in self._files(satellite):
            try:
                contents += path.read_bytes() + b"\0"
            except OSError as error:
                contents += str(error).encode() + b"\0"
        return contents + repr(self._sources_stamp).encode()


def keep_confirmed(config: Path, target: Target) -> None:
    """Believe a set that the fetcher had kept beside the others, where the last pass has shown that it is right."""
    epoch_tai_s, norad_id = target.elements.confirmed_tai_s, target.satellite.satellite.norad_id
    if epoch_tai_s is None or norad_id is None:
        return
    log: Any = structlog.get_logger("elements")
    log.info("elements.confirmed", satellite=target.elements.label, epoch=utc_text(epoch_tai_s, 0))
    with contextlib.suppress(OSError):  # a store of somebody else's: it is chosen all the same
        confirm_doubtful(config / target.station.elements.store, norad_id, epoch_tai_s)


def _stamps(paths: list[Path]) -> Stamp:
    found = []
    for path in paths:
        try:
            stat = path.stat()
            found.append((str(path), stat.st_mtime_ns, stat.st_size, stat.st_ino))
        except OSError:
            found.append((str(path), 0, 0, 0))
    return tuple(found)


def read_again(
    config: Path, name: str, old: Target, coming: Pass, now_tai_s: float, folders: tuple[Path, ...] = ()
) -> Target | str:
    """Read a satellite's elements again; a text says why those in force are better, or why these cannot be used."""
    toml = config / "satellites" / f"{name}.toml"
    try:
        satellite, _ = load_satellite(config, name, load_station(config))
        orientation = old.station.site.orientation
        elements = choose_elements(
            satellite,
            toml,
            now_tai_s,
            orientation,
            max(now_tai_s, coming.rise_tai_s),
            ElementsSources.of(config, old.station.elements),
            last_fit(satellite, old.station, folders),
        )
        if elements.errors:
            raise ElementsError("; ".join(elements.errors))
        changes = {"elements": satellite.elements, "uncertainty": satellite.uncertainty}
        found = replace(old, satellite=old.satellite.model_copy(update=changes), elements=elements)
        if worse := why_worse(old, found, coming):
            news = [one for one in elements.warnings if one not in old.elements.warnings]
            return "; ".join(news) if worse == STILL_BEST and news else worse
        coming_pass(found, now_tai_s)
    except AcuDaemonError as error:
        return f"the new ones cannot be used: {'; '.join(str(error).splitlines())}"
    return found


def why_worse(old: Target, new: Target, coming: Pass) -> str:
    """Why new elements are not taken; empty: they are at least as good for the coming pass."""
    mine, theirs = old.elements, new.elements
    if isfinite(theirs.expected_m):  # all sources were compared, those in force among them
        if (theirs.file, theirs.epoch_tai_s) == (mine.file, mine.epoch_tai_s):
            return STILL_BEST
        if isinstance(mine.propagator, Sgp4Propagator) and isinstance(theirs.propagator, Sgp4Propagator):
            judgement = judge(mine.propagator.elements, theirs.propagator.elements)
            if judgement.judged is Judged.DOUBTFUL and theirs.confirmed_tai_s is None:
                return f"the new ones are doubted: {judgement}"
        return ""
    if is_ephemeris(theirs.propagator):
        spans = spans_tai_s(theirs.propagator)
        if not any(start <= coming.rise_tai_s and coming.set_tai_s <= end for start, end in spans):
            return "the new ephemeris does not cover the coming pass"
        return ""
    if not is_ephemeris(mine.propagator) and theirs.epoch_tai_s < mine.epoch_tai_s:
        return f"the new ones are older: epoch {utc_text(theirs.epoch_tai_s, 0)}"
    far_s, near_s = (abs(one.epoch_tai_s - coming.rise_tai_s) for one in (theirs, mine))
    if not is_ephemeris(mine.propagator) and far_s > near_s:
        return f"the epoch of the new ones, {utc_text(theirs.epoch_tai_s, 0)}, is further from the coming pass"
    given, before = new.satellite.uncertainty, old.satellite.uncertainty
    for key in ("position_km", "velocity_m_s"):
        value, last = getattr(given, key), getattr(before, key)
        if value is not None and last is not None and value > last:
            return f"the new ones are expected to be less exact: {key} = {value:g} in place of {last:g}"
    return ""

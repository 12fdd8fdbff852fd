"""SIMULATION: what a rehearsal is made of, read from a scenario TOML.

[sky]        along_track_s, delta_raan_deg      the satellite's orbit against the elements: late (+), node east (+)
[encoder]    azimuth_bias_deg, elevation_bias_deg, noise_deg
[receiver]   peak_agc_db, agc_noise_db, tracking_noise_deg
[acu]        has_tilt, reply_latency_s, mode, azimuth_deg, elevation_deg, sector_bit
[[loss]]     start_s + duration_s, or from_utc + to_utc; cause; depth_db for a fade
[[fault]]    verb, and start_s, duration_s, count, probability, value, axis, on, seed (fault_verbs.py)
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from acu_daemon.errors import ConfigError
from acu_daemon.sim.fault_verbs import Fault, read_fault
from acu_daemon.sim.toml_table import read_table

Cause = Literal["receiver", "silence-zone", "fade"]
StartMode = Literal["standby", "manual", "remote", "stowed"]
SectorBit = Literal["driven", "undriven", "random", "stuck-0", "stuck-1"]


@dataclass(frozen=True, slots=True)
class SkyErrors:
    """How the real orbit differs from the elements."""

    along_track_s: float = 0.0
    delta_raan_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Encoder:
    """Reading minus true angle; noise is 1 sigma, white, across (azimuth x cos el) and in elevation."""

    azimuth_bias_deg: float = 0.0
    elevation_bias_deg: float = 0.0
    noise_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class ReceiverChoice:
    """AGC on the boresight over no signal, and noise, 1 sigma.

    The peak of 6 dB over a threshold of 3 dB makes the signal end where the beam has lost half its power.
    """

    peak_agc_db: float = 6.0
    agc_noise_db: float = 0.05
    tracking_noise_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class AcuChoice:
    """How the ACU is fitted and how the daemon finds it; angles in the encoder frame."""

    has_tilt: bool = False
    reply_latency_s: float = 0.010
    mode: StartMode = "standby"
    azimuth_deg: float = 0.0
    elevation_deg: float = 90.0
    sector_bit: SectorBit = "driven"  # undriven reads 0 whatever the range; random: another value in every status


@dataclass(frozen=True, slots=True)
class Loss:
    """A time without, or with less, signal: seconds since the start, or between two instants (TAI seconds)."""

    cause: Cause
    start_s: float | None = None
    duration_s: float | None = None
    from_utc: float | None = None
    to_utc: float | None = None
    depth_db: float = 0.0

    def window_tai_s(self, start_tai_s: float) -> tuple[float, float]:
        """First and last instant, for a simulation that starts at start_tai_s.  ValueError: says what is missing."""
        if self.start_s is not None and self.duration_s is not None and self.from_utc is self.to_utc is None:
            start_s, end_s = start_tai_s + self.start_s, start_tai_s + self.start_s + self.duration_s
        elif self.from_utc is not None and self.to_utc is not None and self.start_s is self.duration_s is None:
            start_s, end_s = self.from_utc, self.to_utc
        else:
            raise ValueError("expected either start_s and duration_s, or from_utc and to_utc")
        if end_s <= start_s:
            raise ValueError("the loss must end after it begins")
        if (self.cause == "fade") != (self.depth_db > 0.0):
            raise ValueError("a fade needs depth_db above 0, and only a fade has one")
        return start_s, end_s


@dataclass(frozen=True, slots=True)
class Scenario:
    """Everything that can be chosen about a rehearsal."""

    sky: SkyErrors = SkyErrors()
    encoder: Encoder = Encoder()
    receiver: ReceiverChoice = ReceiverChoice()
    acu: AcuChoice = AcuChoice()
    losses: tuple[Loss, ...] = ()
    faults: tuple[Fault, ...] = ()


_SECTIONS = {"sky": SkyErrors, "encoder": Encoder, "receiver": ReceiverChoice, "acu": AcuChoice}
_LISTS = ("loss", "fault")


def read_faults(path: Path, seed: int = 0) -> tuple[Fault, ...]:
    """Read only the faults of a scenario; seed: added to each of theirs.  ConfigError: as read_scenario."""
    return tuple(replace(fault, seed=fault.seed + seed) for fault in read_scenario(path).faults)


def read_scenario(path: Path) -> Scenario:
    """Read a scenario TOML.  ConfigError: names file, key, value and what was expected."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{path}: {error}") from None
    if unknown := sorted(document.keys() - _SECTIONS.keys() - set(_LISTS)):
        raise ConfigError(
            f"{path}: unknown table {unknown[0]!r}, expected {', '.join(_SECTIONS)}, [[loss]] or [[fault]]"
        )
    lists = {name: document.get(name, []) for name in _LISTS}
    for name, tables in lists.items():
        if not isinstance(tables, list):
            raise ConfigError(f"{path}: {name} is written [[{name}]], once for each")
    try:
        sections: dict[str, Any] = {}
        for name, section in _SECTIONS.items():
            sections[name] = read_table(section, document.get(name, {}), name)
        losses = tuple(_loss(table, i) for i, table in enumerate(lists["loss"], start=1))
        faults = tuple(read_fault(table, f"fault {i}") for i, table in enumerate(lists["fault"], start=1))
        return Scenario(**sections, losses=losses, faults=faults)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None


def _loss(table: object, number: int) -> Loss:
    loss = read_table(Loss, table, f"loss {number}")
    try:
        loss.window_tai_s(0.0)
    except ValueError as error:
        raise ValueError(f"loss {number}: {error}") from None
    return loss

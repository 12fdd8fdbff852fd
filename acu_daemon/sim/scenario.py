"""SIMULATION: what a rehearsal is made of, read from a scenario TOML.

[sky]        along_track_s, delta_raan_deg      the satellite's orbit against the elements: late (+), node east (+)
             light_time                         whether the signal arrives range / c late; left out: where there is air
[air]        pressure_hpa, temperature_c, humidity_percent, refractivity_factor, refractivity_drawn_within, profile
[mount]      ia_deg, ie_deg, ca_deg, npae_deg, an_deg, aw_deg, tf_deg (docs/antenna-model.md)
[drift]      azimuth_deg, elevation_deg, peak_utc_h     of the encoders, from day to night
[encoder]    azimuth_bias_deg, elevation_bias_deg, noise_deg
[receiver]   peak_agc_db, agc_noise_db, tracking_noise_deg
[acu]        has_tilt, reply_latency_s, mode, azimuth_deg, elevation_deg, sector_bit
[[loss]]     start_s + duration_s, or from_utc + to_utc; cause; depth_db for a fade
[[fault]]    verb, and start_s, duration_s, count, probability, value, axis, on, seed (fault_verbs.py)
"""

import tomllib
from dataclasses import dataclass, replace
from math import cos, pi
from pathlib import Path
from typing import Any, Literal

from acu_daemon.errors import ConfigError
from acu_daemon.orbit.timescales import unix_from_tai
from acu_daemon.sim.fault_verbs import Fault, read_fault
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.sim.shell_air import Profile
from acu_daemon.sim.toml_table import read_table

Cause = Literal["receiver", "silence-zone", "fade"]
StartMode = Literal["standby", "manual", "remote", "stowed"]
SectorBit = Literal["driven", "undriven", "random", "stuck-0", "stuck-1"]


@dataclass(frozen=True, slots=True)
class SkyErrors:
    """How the real orbit differs from the elements."""

    along_track_s: float = 0.0
    delta_raan_deg: float = 0.0
    light_time: bool | None = None


@dataclass(frozen=True, slots=True)
class AirChoice:
    """The air over the antenna: its weather, where left out the one that the station's file tells the daemon.

    The refractivity is that of the weather by refractivity_factor, and by one drawn from 1 - refractivity_drawn_within
    to 1 + refractivity_drawn_within, by the simulation's seed.
    """

    pressure_hpa: float | None = None
    temperature_c: float | None = None
    humidity_percent: float | None = None
    refractivity_factor: float = 1.0
    refractivity_drawn_within: float = 0.0
    profile: Profile = "quartic"


@dataclass(frozen=True, slots=True)
class Drift:
    """What the encoders read too much at peak_utc_h o'clock UTC, twelve hours later too little, as a cosine between."""

    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0
    peak_utc_h: float = 18.0

    def at(self, tai_s: float) -> tuple[float, float]:
        """Azimuth's and elevation's at an instant, degrees."""
        if self.azimuth_deg == self.elevation_deg == 0.0:
            return 0.0, 0.0
        share = cos(2.0 * pi * (unix_from_tai(tai_s) / 3600.0 - self.peak_utc_h) / 24.0)
        return share * self.azimuth_deg, share * self.elevation_deg


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
    air: AirChoice | None = None  # None: within 10 % of what the station's file tells the daemon
    mount: MountAxes = MountAxes()
    drift: Drift = Drift()

    def encoder_zero_deg(self, tai_s: float) -> tuple[float, float]:
        """What the encoders read too much at an instant, beside what the mount makes of it: bias and drift."""
        az_deg, el_deg = self.drift.at(tai_s)
        return self.encoder.azimuth_bias_deg + az_deg, self.encoder.elevation_bias_deg + el_deg


_SECTIONS = {
    "sky": SkyErrors,
    "encoder": Encoder,
    "receiver": ReceiverChoice,
    "acu": AcuChoice,
    "air": AirChoice,
    "mount": MountAxes,
    "drift": Drift,
}
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
            if name in document:
                sections[name] = read_table(section, document[name], name)
        if "air" in sections:
            check_air(sections["air"])
        losses = tuple(_loss(table, i) for i, table in enumerate(lists["loss"], start=1))
        faults = tuple(read_fault(table, f"fault {i}") for i, table in enumerate(lists["fault"], start=1))
        return Scenario(**sections, losses=losses, faults=faults)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None


def check_air(air: AirChoice) -> None:
    """ValueError: says what no air has."""
    ranges = {
        "pressure_hpa": (200.0, 1100.0),
        "temperature_c": (-80.0, 60.0),
        "humidity_percent": (0.0, 100.0),
        "refractivity_factor": (0.0, 1.5),
        "refractivity_drawn_within": (0.0, 0.5),
    }
    for key, (least, most) in ranges.items():
        value = getattr(air, key)
        if value is not None and not least <= value <= most:
            raise ValueError(f"[air] {key} = {value:g}: expected {least:g} to {most:g}")


def _loss(table: object, number: int) -> Loss:
    loss = read_table(Loss, table, f"loss {number}")
    try:
        loss.window_tai_s(0.0)
    except ValueError as error:
        raise ValueError(f"loss {number}: {error}") from None
    return loss

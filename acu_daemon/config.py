"""station.toml and satellites/NAME.toml: read, checked, turned into the rooms' values (design section 7).

Unknown keys, wrong units and impossible values stop the start with file, key, value and what was expected.
"""

import errno
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from acu_daemon.assist.estimators.estimator import EstimatorSettings
from acu_daemon.assist.settings import StateSigmas
from acu_daemon.config_problems import in_words
from acu_daemon.config_section import Section
from acu_daemon.config_tables import SatelliteFile, StationFile, UncertaintySection
from acu_daemon.control.axis_watch import Bounds
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.errors import ConfigError

HALF_SERVO_TICK_S = 0.010  # ICD section 6: a command waits for half a 50 Hz servo tick on average

File = TypeVar("File", bound=Section)
_NONE: Mapping[str, type[Section]] = {}


def load_station(directory: Path) -> StationFile:
    """Read DIR/station.toml.  ConfigError: names file, key, value and what was expected."""
    path = directory / "station.toml"
    return parse(StationFile, path, read_toml(path))


def satellite_names(directory: Path) -> list[str]:
    """Names of the satellites' files, sorted.  ConfigError: the directory cannot be looked into."""
    satellites = directory / "satellites"
    try:
        names = os.listdir(satellites)  # noqa: PTH208  Path.glob finds nothing where it may not look
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        raise ConfigError(f"{satellites}: cannot be read: {error.strerror}") from None
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml") and not name.startswith("."))


def load_satellite(directory: Path, name: str, station: StationFile) -> tuple[SatelliteFile, StationFile]:
    """Read DIR/satellites/NAME.toml; also the station with that file's overrides applied."""
    path = directory / "satellites" / f"{name}.toml"
    if not _exists(path):
        known = ", ".join(satellite_names(directory)) or "none"
        raise ConfigError(f"{path}: no such file; satellites in {directory}: {known}")
    satellite = parse(SatelliteFile, path, read_toml(path))
    sections: dict[str, Section] = {
        "receiver": station.receiver,
        "readings": station.readings,
        "tracking": station.tracking,
    }
    for key, section in sections.items():
        override: dict[str, Any] = getattr(satellite, key)
        sections[key] = parse(type(section), path, section.model_dump() | override, under=key)
    return satellite, station.model_copy(update=sections)


def _exists(path: Path) -> bool:
    """Whether there is such a file; one that may not be looked at is there, and whoever reads it says why it cannot."""
    try:
        return path.exists()
    except OSError as error:
        return error.errno != errno.ENAMETOOLONG


def read_toml(path: Path, must_hold: str = "the station's [station] and [acu] tables") -> dict[str, Any]:
    """Read a TOML file.  ConfigError: names the file and what is wrong with it."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; it must hold {must_hold}") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start}: expected UTF-8 text; save the file in that encoding") from None
    except (ValueError, RecursionError) as error:  # tomllib's own errors, and numbers or nesting beyond Python's limits
        raise ConfigError(f"{path}: not TOML: {error}") from None


def parse(
    model: type[File], path: Path, values: dict[str, Any], under: str = "", also: Mapping[str, type[Section]] = _NONE
) -> File:
    """Make a table of a file's values.  ConfigError: names file, key, value and what was expected.

    also: other files that a misplaced key may belong to.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        files = also or {"station.toml": StationFile, "the satellite's file": SatelliteFile}
        known = {name: _keys(kind) for name, kind in files.items()}
        problems = [f"{path}: {in_words(dict(item), under, known)}" for item in error.errors()]
        raise ConfigError("\n".join(problems)) from None


def _keys(model: type[Section], table: str = "") -> dict[str, set[str]]:
    """The keys of a kind of file, by table."""
    found = {table: set(model.model_fields)}
    for name, field in model.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, Section):
                for under, keys in _keys(kind, f"{table}.{name}".lstrip(".")).items():
                    found.setdefault(under, set()).update(keys)
    return found


def control_config(station: StationFile, satellite: SatelliteFile, byte_time_s: float) -> ControlConfig:
    """What the decision of a tick needs; byte_time_s is the wire time of one character (0 on TCP)."""
    acu = station.acu
    wire_s = 17 * byte_time_s  # a WRITE AND STATUS command, ICD section 4
    return ControlConfig(
        azimuth=acu.azimuth.limits(),
        elevation=acu.elevation.limits(),
        period_s=acu.period_s,
        sample_delay_s=wire_s + acu.device_delay_s,
        poll_sample_delay_s=5 * byte_time_s + acu.device_delay_s,
        effect_delay_s=wire_s + acu.device_delay_s + HALF_SERVO_TICK_S,
        beamwidth_deg=station.receiver.beamwidth_deg,
        lock_dwell_s=station.receiver.lock_dwell_s,
        min_elevation_deg=station.station.min_elevation_deg,
        preposition_s=station.tracking.preposition_s,
        acquire_s=satellite.fallback.acquire_s,
        hold_s=satellite.fallback.hold_s,
        search_s=satellite.fallback.search_s,
        search_along_s=station.tracking.search_along_s,
        search_across_deg=station.tracking.search_across_deg,
        is_armed=station.safety.arm == "auto",
        register_watchdog_s=station.safety.register_watchdog_s,
        clock_alarm_deg=station.safety.clock_alarm_beam_fraction * station.receiver.beamwidth_deg,
        following=Bounds(station.safety.following_error_deg, station.safety.following_error_s),
    )


def estimator_settings(station: StationFile, satellite: SatelliteFile) -> EstimatorSettings:
    """What the estimators need of the configuration."""
    return EstimatorSettings(
        sigma_azimuth_deg=station.readings.sigma_azimuth_deg,
        sigma_elevation_deg=station.readings.sigma_elevation_deg,
        max_fit_elevation_deg=station.tracking.max_fit_elevation_deg,
        beamwidth_deg=station.receiver.beamwidth_deg,
        azimuth=station.acu.azimuth.limits(),
        elevation=station.acu.elevation.limits(),
        bias_sigma_azimuth_deg=station.readings.bias_sigma_azimuth_deg,
        bias_sigma_elevation_deg=station.readings.bias_sigma_elevation_deg,
        bias_sigma_azimuth_sec_deg=station.readings.bias_sigma_azimuth_sec_deg,
        bias_sigma_elevation_cot_deg=station.readings.bias_sigma_elevation_cot_deg,
        orbit_sigmas=_orbit_sigmas(satellite.uncertainty),
        station_sigma_m=station.station.uncertainty_m / 2**0.5,  # of east and of north each
    )


def _orbit_sigmas(given: UncertaintySection) -> StateSigmas | None:
    """The satellite's own a-priori; None where the file says nothing: then the kind and age of the elements say it."""
    if given.position_km is None and given.velocity_m_s is None:
        return None
    position_m = given.position_km * 1e3 if given.position_km is not None else (given.velocity_m_s or 0.0) * 1e3
    velocity_m_s = given.velocity_m_s if given.velocity_m_s is not None else position_m * 1e-3  # a low orbit's motion
    return StateSigmas(position_m, velocity_m_s)

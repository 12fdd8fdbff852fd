"""Which ACU is meant: a driver by the name of its dialect, `[acu] dialect` of station.toml."""

from collections.abc import Callable
from dataclasses import dataclass

from acu_daemon.acu.driver import AcuDriver
from acu_daemon.drivers.rotctl.rotctl_driver import RotctlDriver
from acu_daemon.drivers.sa3842.codec import address_byte
from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver


@dataclass(frozen=True, slots=True)
class DriverSettings:
    """What of station.toml a driver may need.  address: of the ACU on its line, for dialects that have one."""

    address: str = "1"
    device_delay_s: float = 0.010
    dead_band_deg: float = 0.5  # of rotators with relays


def _sa3842(settings: DriverSettings) -> AcuDriver:
    return Sa3842Driver(address_byte(settings.address), settings.device_delay_s)


def _rotctl(settings: DriverSettings) -> AcuDriver:
    return RotctlDriver(settings.dead_band_deg, settings.device_delay_s)


DIALECTS: dict[str, Callable[[DriverSettings], AcuDriver]] = {"sa3842": _sa3842, "rotctl": _rotctl}


def make_driver(dialect: str, settings: DriverSettings) -> AcuDriver:
    """The driver of a dialect, at the beginning of its dialogue.  KeyError: there is none of this name."""
    return DIALECTS[dialect](settings)

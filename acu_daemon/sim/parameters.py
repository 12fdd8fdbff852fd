"""SIMULATION of the parameters of 3Bh/3Ch: names, codes, power-up values and ranges (docs/protocol.md, Parameters)."""

from acu_daemon.drivers.sa3842.angles import elevation_deg
from acu_daemon.drivers.sa3842.status_block import AGC_LSB_DB
from acu_daemon.model import AxisLimits

TIME_LSB_S = 0.02
_POWER_UP = {"A": 250, "R": 750, "P": 750, "M": 0, "T": 60, "S": 0, "W": 0}
_MAX_THRESHOLD = 0xFFF
_MAX_PREFERENCE = 2


class Parameters:
    """The codes by name, with readers in units."""

    def __init__(self, elevation: AxisLimits) -> None:
        self._codes = dict(_POWER_UP)
        self._elevation = elevation

    def code(self, name: str) -> int:
        """Code of a parameter."""
        return self._codes[name]

    def is_in_range(self, name: str, code: int) -> bool:
        """Whether a code may be written."""
        if name == "M":
            return elevation_deg(code) <= self._elevation.max_deg
        return code <= {"T": _MAX_THRESHOLD, "S": _MAX_PREFERENCE}.get(name, 0xFFFF)

    def write(self, name: str, code: int) -> bool:
        """Set a parameter; whether it changed."""
        has_changed = self._codes[name] != code
        self._codes[name] = code
        return has_changed

    @property
    def track_valid_s(self) -> float:
        """A: tracked for this long, a loss goes to rate memory."""
        return self._codes["A"] * TIME_LSB_S

    @property
    def rate_memory_s(self) -> float:
        """R: longest time in rate memory."""
        return self._codes["R"] * TIME_LSB_S

    @property
    def position_memory_s(self) -> float:
        """P: longest time in position memory."""
        return self._codes["P"] * TIME_LSB_S

    @property
    def watchdog_s(self) -> float:
        """W: longest time between register writes while they are followed; 0 is off."""
        return self._codes["W"] * TIME_LSB_S

    @property
    def lowest_el_deg(self) -> float:
        """M: lowest elevation driven in autotrack."""
        return elevation_deg(self._codes["M"])

    @property
    def threshold_db(self) -> float:
        """T: acquisition threshold."""
        return self._codes["T"] * AGC_LSB_DB

    @property
    def sector_preference(self) -> int:
        """S: 0 nearest turn, 1 low half, 2 high half."""
        return self._codes["S"]

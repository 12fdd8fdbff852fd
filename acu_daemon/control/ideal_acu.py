"""An ACU that does at once what it is told, and drives that obey: what a phantom pass is flown with.  Pure."""

from dataclasses import replace

from acu_daemon.acu.commands import (
    AcuMode,
    Command,
    FreeTurnChoice,
    Identify,
    PointAndPoll,
    PointAt,
    Poll,
    ReadCommanded,
    ReadFaults,
    ReadTurnChoice,
    SelectBackup,
    SelectMode,
)
from acu_daemon.acu.replies import (
    AcuIdentity,
    AcuStatus,
    Commanded,
    Done,
    FaultReport,
    Refused,
    Reply,
    TurnChoice,
)
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.pointing.wrap import middle_deg, nearest_turn


class IdealAcu:
    """The antenna as it stands, azimuth continuous, and its ACU; owned by whoever flies it."""

    def __init__(self, az_deg: float, el_deg: float, config: ControlConfig) -> None:
        self._config = config
        self.az, self.el = AxisState(az_deg), AxisState(el_deg)
        self._goal = az_deg, el_deg
        self._before = self._goal
        self._status = AcuStatus(az_deg % 360.0, el_deg, AcuMode.STANDBY)

    def move(self, dt_s: float) -> None:
        """Follow the registers, in the mode that does so, as fast as the drives can."""
        goal, before = self._goal, self._before
        self._before = goal
        if self._status.mode is not AcuMode.REMOTE:
            return
        az_rate, el_rate = ((now - last) / dt_s for now, last in zip(goal, before, strict=True))
        self.az = step(self.az, goal[0], az_rate, dt_s, self._config.azimuth)
        self.el = step(self.el, goal[1], el_rate, dt_s, self._config.elevation)

    @property
    def status(self) -> AcuStatus:
        """What it shows."""
        can, az_deg = self._config.acu, self.az.position_deg
        return replace(
            self._status,
            az_deg=az_deg % 360.0,
            el_deg=self.el.position_deg,
            is_sector_high=can.has_sector_bit and az_deg >= middle_deg(self._config.azimuth),
            tilt_deg=self._config.tilt_deg,
            turns_deg=az_deg if can.is_azimuth_continuous else None,
        )

    def answer(self, command: Command) -> Reply:
        """Do what it is told."""
        match command:
            case Poll():
                return self.status
            case PointAndPoll(az_deg, el_deg):
                self._point(az_deg, el_deg)
                return self.status
            case PointAt(az_deg, el_deg):
                self._point(az_deg, el_deg)
            case SelectMode(mode):
                self._status = replace(self._status, mode=mode)
            case SelectBackup(backup):
                self._status = replace(self._status, backup_selected=backup)
            case Identify():
                return AcuIdentity("ideal", is_known=True, is_simulated=True)
            case ReadCommanded():
                return Commanded(*self._goal)
            case ReadTurnChoice():
                return TurnChoice(is_nearest=True)
            case ReadFaults():
                return FaultReport()
            case FreeTurnChoice():
                pass
            case _:
                return Refused()
        return Done()

    def _point(self, az_deg: float, el_deg: float) -> None:
        """Of a bearing on several turns of the cable the nearest."""
        turned_deg = nearest_turn(az_deg, self.az.position_deg, self._config.azimuth)
        self._goal = az_deg if turned_deg is None else turned_deg, el_deg

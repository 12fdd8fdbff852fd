"""[acu] of station.toml: the line to the antenna control unit, and the limits of its axes."""

from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from acu_daemon.acu.driver import AcuDriver
from acu_daemon.config.section import Section
from acu_daemon.drivers.dialects import DriverSettings, make_driver
from acu_daemon.drivers.sa3842.codec import address_byte
from acu_daemon.edge.link import make_link
from acu_daemon.errors import UsageError
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.tilt import TiltAxis

MOST_SA3842_EL_DEG = 179.99  # two's complement: 180 deg would be -180


class AxisSection(Section):
    min_deg: float = Field(
        ge=-720,
        le=720,
        description=(
            "Lower soft limit, encoder frame; negative angles are further turns of the cable.  Decides where commands "
            "end, and which turn a pass is flown on."
        ),
    )
    max_deg: float = Field(
        ge=-720,
        le=720,
        json_schema_extra={"range": "min_deg to 720"},
        description="Upper soft limit.  Decides the same.",
    )
    max_rate_deg_s: float = Field(
        gt=0,
        le=90,
        description=(
            "The fastest that the drive turns.  Decides how fast commands move, when the antenna sets out, and what "
            "of a pass near the zenith cannot be followed."
        ),
    )
    max_acceleration_deg_s2: float = Field(
        gt=0,
        le=360,
        description=(
            "How fast the drive gets there.  Decides the way to the rise, and how long a brake takes before an axis "
            "is called out of control."
        ),
    )

    @model_validator(mode="after")
    def _min_below_max(self) -> "AxisSection":
        self._must_be_below("min_deg", "max_deg")
        return self

    def limits(self) -> AxisLimits:
        return AxisLimits(self.min_deg, self.max_deg, self.max_rate_deg_s, self.max_acceleration_deg_s2)


class ElevationSection(AxisSection):
    min_deg: float = Field(ge=-90, le=180, description="Lower soft limit, encoder frame.  Decides where commands end.")
    max_deg: float = Field(
        ge=-90,
        le=180,
        json_schema_extra={"range": "min_deg to 180"},
        description=(
            "Upper soft limit; above 90 the antenna can plunge, and from 180 less min_elevation_deg on a pass near the "
            "zenith is flown over the top (docs/pass-plan.md, Over the top).  Decides the same."
        ),
    )


class TiltSection(AxisSection):
    min_deg: float = Field(ge=-45, le=0, description="Lower limit of the tilt.  Decides which tilts a pass may have.")
    max_deg: float = Field(ge=0, le=45, description="Upper limit.  Decides the same.")
    max_rate_deg_s: float = Field(
        gt=0,
        le=90,
        description="The fastest that it turns.  Decides how long before a pass the antenna sets out.",
    )
    max_acceleration_deg_s2: float = Field(
        default=0.5, gt=0, le=360, description="How fast it gets there.  Decides the same."
    )
    towards_deg: float = Field(
        default=90.0,
        ge=0,
        lt=360,
        description=(
            "The azimuth towards which a positive tilt leans the pedestal; 90: a tilt east and west.  Decides where "
            "the beam points."
        ),
    )

    def axis(self) -> TiltAxis:
        return TiltAxis(self.limits(), self.towards_deg)


def _address(value: object) -> str:
    text = str(value)
    address_byte(text)
    return text


def _url(value: str) -> str:
    try:
        make_link(value)
    except UsageError as error:
        raise ValueError(str(error)) from None
    return value


class AcuSection(Section):
    url: Annotated[str, AfterValidator(_url)] = Field(
        json_schema_extra={"range": "tcp:// or serial://"},
        description=(
            "The link: tcp://HOST:PORT, or serial:///dev/DEVICE?baud=9600&format=8N1.  Decides how bytes travel; "
            "`baud` also how long a frame is on the wire, over a terminal server too (tcp://HOST:PORT?baud=9600)."
        ),
    )
    azimuth: AxisSection = Field(description="Limits of the azimuth axis and its drive.")
    elevation: ElevationSection = Field(description="Limits of the elevation axis and its drive.")
    tilt: TiltSection | None = Field(
        default=None,
        description=(
            "A motorised tilt under the pedestal; left out: there is none, or it stays as it is (docs/pass-plan.md, "
            "Tilt)."
        ),
    )
    dialect: Literal["sa3842", "rotctl"] = Field(
        default="sa3842",
        description=(
            "What the ACU speaks: `sa3842` (docs/protocol.md), or `rotctl`, a Hamlib rotator behind rotctld "
            "(docs/rotators.md).  Decides which driver is used, and with it what the antenna can do."
        ),
    )
    address: Annotated[str, BeforeValidator(_address)] = Field(
        default="1",
        json_schema_extra={"range": "`1` to `o`"},
        description=(
            "The ACU's address on the line, one character.  Decides which ACU answers where several share a line."
        ),
    )
    dead_band_deg: float = Field(
        default=0.5,
        ge=0.05,
        le=10,
        description=(
            "Of a rotator (`rotctl`): it is sent to another angle only when that differs by more from the last one.  "
            "Decides how often relays switch, and how near to the path the antenna is."
        ),
    )
    period_s: float = Field(
        default=0.1,
        ge=0.1,
        le=0.15,
        description=(
            "Time between two ticks.  Decides how often the ACU is polled and its registers are written; longer only "
            "for a slow line."
        ),
    )
    device_delay_s: float = Field(
        default=0.010,
        ge=0,
        le=0.1,
        description=(
            "From the end of a request until the ACU samples its angles.  Decides the time tag of readings, and for "
            "which moment commands are computed."
        ),
    )

    @model_validator(mode="after")
    def _is_of_its_dialect(self) -> "AcuSection":
        if self.dialect == "rotctl" and not self.url.startswith("tcp:"):
            expected = 'expected url = "tcp://HOST:4533", where rotctld is'
            raise ValueError(f'dialect = "rotctl": {expected}, not {self.url!r}')
        if self.dialect == "sa3842" and self.elevation.max_deg > MOST_SA3842_EL_DEG:
            told = f"its angles end before 180 deg, expected at most {MOST_SA3842_EL_DEG:g}"
            raise ValueError(f'elevation.max_deg = {self.elevation.max_deg:g}: dialect = "sa3842": {told}')
        if self.dialect != "sa3842" and self.tilt is not None:
            raise ValueError(f'tilt: dialect = "{self.dialect}" has no tilt register, leave the table out')
        if self.dialect != "rotctl" and "dead_band_deg" in self.model_fields_set:
            raise ValueError(f'dead_band_deg: dialect = "{self.dialect}" has none, leave it out')
        return self

    def driver(self) -> AcuDriver:
        """The driver of this ACU, at the beginning of its dialogue."""
        return make_driver(self.dialect, DriverSettings(self.address, self.device_delay_s, self.dead_band_deg))

"""[envelope] of station.toml: what stands around the antenna, and what its beam keeps out of (docs/envelope.md)."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field, PlainValidator, model_validator

from acu_daemon.config.section import Name, Section
from acu_daemon.model import Site
from acu_daemon.pointing.keep_out import KeepOut, Sun
from acu_daemon.pointing.skyline import Skyline, skyline_of

Points = tuple[tuple[float, float], ...]
MASK_EXPECTED = 'expected a CSV file beside station.toml ("horizon.csv"), or [[azimuth, elevation], ...] in degrees'


def _mask(value: object) -> str | Points | None:
    if value is None or (isinstance(value, str) and value):
        return value
    if not isinstance(value, list | tuple):
        raise ValueError(MASK_EXPECTED)
    points = []
    for one in value:
        is_pair = isinstance(one, list | tuple) and len(one) == 2
        if not is_pair or not all(isinstance(angle, int | float) and not isinstance(angle, bool) for angle in one):
            raise ValueError(f"{one!r} in it: {MASK_EXPECTED}")
        points.append((float(one[0]), float(one[1])))
    skyline_of(tuple(points))
    return tuple(points)


class KeepOutSection(Section):
    name: Name = Field(
        default="the keep-out", description="What stands there, for people.  Decides what a refusal calls it."
    )
    az_from_deg: float = Field(
        ge=-360,
        le=360,
        description=(
            "Where it begins, going clockwise, from true north.  Decides where the beam is not commanded to, on any "
            "turn of the cable."
        ),
    )
    az_to_deg: float = Field(
        ge=-360,
        le=360,
        description="Where it ends; the same as az_from_deg: all around.  Decides the same.",
    )
    el_from_deg: float = Field(default=-90.0, ge=-90, le=90, description="Its lower edge.  Decides the same.")
    el_to_deg: float = Field(
        default=90.0,
        ge=-90,
        le=90,
        json_schema_extra={"range": "el_from_deg to 90"},
        description="Its upper edge.  Decides the same.",
    )

    @model_validator(mode="after")
    def _from_below_to(self) -> "KeepOutSection":
        self._must_be_below("el_from_deg", "el_to_deg")
        return self

    def zone(self) -> KeepOut:
        return KeepOut(self.name, self.az_from_deg, self.az_to_deg, self.el_from_deg, self.el_to_deg)


class EnvelopeSection(Section):
    mask: Annotated[str | Points | None, PlainValidator(_mask)] = Field(
        default=None,
        json_schema_extra={"range": "a path, or `[[azimuth, elevation], ...]`"},
        description=(
            "The skyline: a CSV of az_deg,el_deg beside station.toml, or the pairs themselves.  Decides when a "
            "satellite rises and sets, above min_elevation_deg, and where its silence is no loss."
        ),
    )
    sun_policy: Literal["avoid", "warn", "off"] = Field(
        default="warn",
        description=(
            "`avoid`: the beam keeps out of the sun's disc; `warn`: passes near it are told, and followed.  Decides "
            "whether a path through it is led around."
        ),
    )
    sun_keep_out_deg: float = Field(
        default=2.0,
        gt=0,
        le=45,
        description=(
            "Between boresight and the sun's middle.  Decides what near the sun is, in warnings and commands alike."
        ),
    )
    response_time_s: float = Field(
        default=60.0,
        ge=0,
        le=3600,
        description=(
            "How long a person needs to act.  Decides from when on an antenna that stands still before the sun, and "
            "may not be moved, is an alarm."
        ),
    )
    stow_az_deg: float | None = Field(
        default=None,
        ge=-720,
        le=720,
        description=(
            "Where the ACU's own stow position is, encoder frame; left out: not known.  Decides whether a straight "
            "way to it that leads through a keep-out is told."
        ),
    )
    stow_el_deg: float | None = Field(
        default=None, ge=-90, le=180, description="The same in elevation.  Decides the same."
    )
    keep_out: Sequence[KeepOutSection] = Field(
        default=(), description="A box of azimuth and elevation that the beam keeps out of; any number of them."
    )

    @model_validator(mode="after")
    def _stow_whole(self) -> "EnvelopeSection":
        if (self.stow_az_deg is None) != (self.stow_el_deg is None):
            raise ValueError("expected stow_az_deg and stow_el_deg both, or neither")
        return self

    @property
    def stow_deg(self) -> tuple[float, float] | None:
        both = self.stow_az_deg, self.stow_el_deg
        return None if both[0] is None or both[1] is None else (both[0], both[1])

    @property
    def skyline(self) -> Skyline | None:
        """ValueError: the mask is a file's name, and nobody has read it (config.load does)."""
        if isinstance(self.mask, str):
            raise ValueError(f"{self.mask} is not read")
        return None if self.mask is None else skyline_of(self.mask)

    def told(self) -> str:
        """Say what bounds the beam beside the limits; empty: nothing that the file has asked for."""
        skyline, zones = self.skyline, [one.name for one in self.keep_out]
        parts = []
        if skyline is not None:
            parts.append(f"a mask of {min(skyline.el_deg):g} to {max(skyline.el_deg):g} deg")
        if zones:
            parts.append(f"kept out of {', '.join(zones)}")
        if self.sun_policy == "avoid":
            parts.append(f"kept {self.sun_keep_out_deg:g} deg from the sun")
        return "; ".join(parts)

    def sun(self, site: Site) -> Sun | None:
        return None if self.sun_policy == "off" else Sun(site, self.sun_keep_out_deg, self.sun_policy)

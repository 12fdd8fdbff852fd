"""What every table of a TOML file has in common, and the kinds of values that several have."""

import ipaddress
from datetime import UTC, datetime
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from acu_daemon.orbit.timescales import tai_from_utc


def _tai(value: object) -> float:
    if isinstance(value, datetime):
        if value.tzinfo is None:
            raise ValueError("expected a time that ends in Z (UTC)")
        return tai_from_utc(value.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ"))
    if isinstance(value, str):
        return tai_from_utc(value)
    raise ValueError("expected a time like 1989-01-31T09:58:00Z")


UtcTime = Annotated[float, BeforeValidator(_tai)]
Positive = Annotated[float, Field(gt=0)]
Name = Annotated[str, Field(min_length=1)]


def address_of(text: str, example: str) -> tuple[str, int]:
    """Address and port of `ADDRESS:PORT`, in numbers.  ValueError: it is none; example: one that is."""
    host, _, port = text.rpartition(":")
    host = host.strip("[]")
    try:
        ipaddress.ip_address(host)
        number = int(port) if port.isdecimal() else -1
    except ValueError:
        number = -1
    if not 0 <= number <= 65535:
        raise ValueError(f"expected ADDRESS:PORT in numbers, such as {example}")
    return host, number


class Section(BaseModel):
    """A table of a TOML file: no unknown keys, no infinite numbers, no text where a number belongs."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    def _must_be_below(self, lower: str, upper: str) -> None:
        low, high = getattr(self, lower), getattr(self, upper)
        if low >= high:
            raise ValueError(f"{lower} = {low:g}: expected less than {upper} = {high:g}")

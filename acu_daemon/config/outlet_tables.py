"""[metrics] and [rotctld] of station.toml: what other programs are told, and where."""

import ipaddress

from pydantic import Field, field_validator

from acu_daemon.config.section import Name, Section


def address_of(text: str, example: str) -> tuple[str, int]:
    """Address and port of ADDRESS:PORT.  ValueError: it is none; example: one that is."""
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


class MetricsSection(Section):
    listen: Name | None = Field(
        default=None,
        json_schema_extra={"range": "ADDRESS:PORT"},
        description=(
            "Where metrics are served over HTTP for Prometheus, such as 127.0.0.1:9842; whoever reaches the address "
            "reads them.  Decides whether there are any (docs/metrics.md)."
        ),
    )

    @field_validator("listen")
    @classmethod
    def _is_address(cls, value: str | None) -> str | None:
        if value is not None:
            address_of(value, "127.0.0.1:9842")
        return value

    @property
    def address(self) -> tuple[str, int] | None:
        return None if self.listen is None else address_of(self.listen, "")


class RotctldSection(Section):
    listen: Name | None = Field(
        default=None,
        json_schema_extra={"range": "ADDRESS:PORT"},
        description=(
            "Where programs for rotators find the antenna, such as 127.0.0.1:4533, in Hamlib's protocol.  Decides "
            "whether there is such a port; who may lead the antenna by it is a person's word (docs/rotctld.md)."
        ),
    )

    @field_validator("listen")
    @classmethod
    def _is_address(cls, value: str | None) -> str | None:
        if value is not None:
            address_of(value, "127.0.0.1:4533")
        return value

    @property
    def address(self) -> tuple[str, int] | None:
        return None if self.listen is None else address_of(self.listen, "")

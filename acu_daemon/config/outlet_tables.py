"""[metrics], [rotctld] and [mqtt] of station.toml: what other programs are told, and where."""

from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field, field_validator, model_validator

from acu_daemon.config.section import Name, Section, address_of


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

    stop: Literal["anyone", "lease"] = Field(
        default="anyone",
        description=(
            "Whose `S` stops the antenna: anyone's, as STOP and disarmed until a person arms again, or only that of "
            "who has the write lease, such as where programs send it without being asked to.  Decides that."
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


class MqttSection(Section):
    url: Name | None = Field(
        default=None,
        json_schema_extra={"range": "mqtt://HOST:PORT, mqtts://HOST:PORT"},
        description=(
            "The MQTT broker to which state, events and schedule are published; mqtts: with TLS.  Decides whether "
            "they are (docs/mqtt.md)."
        ),
    )
    topic: Name = Field(
        default="acu-daemon",
        json_schema_extra={"range": "a topic without + and #"},
        description="What all topics begin with; of several stations at one broker each needs its own.  Decides that.",
    )
    user: Name | None = Field(default=None, description="As whom the broker is spoken to.  Decides that.")
    password_file: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a path"},
        description="A file beside station.toml, or elsewhere, of mode 0600, with the password.  Decides that.",
    )
    discovery_prefix: str = Field(
        default="homeassistant",
        json_schema_extra={"range": "a topic without + and #, or empty"},
        description="Where Home Assistant looks for devices; empty: it is told none.  Decides whether it finds one.",
    )

    @field_validator("url")
    @classmethod
    def _is_url(cls, value: str | None) -> str | None:
        if value is not None:
            _broker(value)
        return value

    @field_validator("topic", "discovery_prefix")
    @classmethod
    def _is_topic(cls, value: str) -> str:
        if set("+#\0") & set(value) or value.strip("/") != value:
            raise ValueError("expected a topic without +, # and a / at its ends")
        return value

    @model_validator(mode="after")
    def _is_whole(self) -> "MqttSection":
        if self.password_file is not None and self.user is None:
            raise ValueError("password_file: expected a user too")
        return self

    @property
    def broker(self) -> tuple[str, int, bool] | None:
        """Host, port, whether with TLS; None: there is none."""
        return None if self.url is None else _broker(self.url)


def _broker(url: str) -> tuple[str, int, bool]:
    parts = urlsplit(url)
    try:
        port = parts.port
    except ValueError:
        port = -1
    if parts.scheme not in ("mqtt", "mqtts") or not parts.hostname or port == -1 or parts.username or parts.path:
        raise ValueError("expected mqtt://HOST:PORT or mqtts://HOST:PORT; a user and a password have keys of their own")
    return parts.hostname, port or (8883 if parts.scheme == "mqtts" else 1883), parts.scheme == "mqtts"

"""What is published over MQTT: topics and payloads, and how Home Assistant finds them.  Pure.

TOPIC/availability   online, offline: the last will           retained
TOPIC/state          the snapshot of docs/status.md           retained, once a second
TOPIC/event          a line of the log                        as they come
TOPIC/schedule       the passes to come, with their states    retained, when it changes
"""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from acu_daemon import __version__
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms

ONLINE, OFFLINE = b"online", b"offline"


@dataclass(frozen=True, slots=True)
class MqttMessage:
    """One to be published."""

    topic: str
    payload: bytes
    is_retained: bool = False


@dataclass(frozen=True, slots=True)
class Topics:
    """Where a station publishes.  base: without a slash at its end; station: its name, for people."""

    base: str
    station: str

    @property
    def availability(self) -> str:
        return f"{self.base}/availability"

    def state(self, seen: Snapshot) -> MqttMessage:
        """The snapshot with its alarms, as one JSON object."""
        told = asdict(seen) | {"alarms": alarms(seen)}
        return MqttMessage(f"{self.base}/state", _json(told), is_retained=True)

    def event(self, line: dict[str, str]) -> MqttMessage:
        """A line of the log."""
        return MqttMessage(f"{self.base}/event", _json(line))

    def schedule(self, passes: Sequence[Any]) -> MqttMessage:
        """The passes to come."""
        return MqttMessage(f"{self.base}/schedule", _json(list(passes)), is_retained=True)


# Key of the state, name, what Home Assistant makes of it.
SENSORS: tuple[tuple[str, str, dict[str, str | int]], ...] = (
    ("verdict", "Verdict", {"icon": "mdi:satellite-uplink"}),
    ("state", "State", {"icon": "mdi:state-machine"}),
    ("satellite", "Satellite", {"icon": "mdi:satellite-variant"}),
    ("az_deg", "Azimuth", {"unit_of_measurement": "°", "suggested_display_precision": 2}),
    ("el_deg", "Elevation", {"unit_of_measurement": "°", "suggested_display_precision": 2}),
    ("off_path_deg", "Off the path", {"unit_of_measurement": "°", "suggested_display_precision": 3}),
    ("agc_db", "AGC", {"unit_of_measurement": "dB", "device_class": "signal_strength"}),
    ("signal_db", "Signal", {"unit_of_measurement": "dB", "device_class": "signal_strength"}),
    ("inside_s", "Prediction good for", {"unit_of_measurement": "s", "device_class": "duration"}),
    ("rise_utc", "Rise", {"device_class": "timestamp"}),
    ("set_utc", "Set", {"device_class": "timestamp"}),
)
BINARY_SENSORS: tuple[tuple[str, str, str, str], ...] = (  # key, name, when it is on, device class
    ("is_link_up", "Link", "value_json.is_link_up", "connectivity"),
    ("is_acquired", "Signal acquired", "value_json.is_acquired", "connectivity"),
    ("latch", "Axis latched", "value_json.latch != ''", "problem"),
    ("alarms", "Alarm", "value_json.alarms | length > 0", "problem"),
)


def discovery(topics: Topics, prefix: str) -> Iterator[MqttMessage]:
    """What Home Assistant reads to make a device with its sensors of the station."""
    node = re.sub(r"[^a-zA-Z0-9_-]+", "_", topics.base)
    device = {"identifiers": [node], "name": topics.station, "manufacturer": "acu-daemon", "sw_version": __version__}
    for key, name, more in SENSORS:
        value = f"value_json.{key}"
        template = f"{{{{ {value} if {value} not in (none, '') else none }}}}"
        yield _entity("sensor", topics, prefix, node, key, {"name": name, "value_template": template, **more}, device)
    for key, name, when, kind in BINARY_SENSORS:
        template = f"{{{{ 'ON' if {when} else 'OFF' }}}}"
        what: dict[str, str | int] = {"name": name, "value_template": template, "device_class": kind}
        yield _entity("binary_sensor", topics, prefix, node, key, what, device)


def _entity(
    kind: str, topics: Topics, prefix: str, node: str, key: str, what: dict[str, str | int], device: dict[str, Any]
) -> MqttMessage:
    told: dict[str, Any] = {
        **what,
        "unique_id": f"{node}_{key}",
        "object_id": f"{node}_{key}",
        "state_topic": f"{topics.base}/state",
        "availability_topic": topics.availability,
        "expire_after": 30,
        "device": device,
    }
    return MqttMessage(f"{prefix}/{kind}/{node}/{key}/config", _json(told), is_retained=True)


def _json(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":"), default=str).encode()

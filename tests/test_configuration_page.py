"""docs/configuration.md: written from the models; every key with unit, default, range, what it is and decides."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from config_files import BROUWER, STATION
from pydantic import ValidationError
from script_modules import load

from acu_daemon.config.acu_tables import AcuSection, AxisSection, ElevationSection
from acu_daemon.config.antenna_tables import AtmosphereSection, MountSection
from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.config.envelope_tables import EnvelopeSection, KeepOutSection
from acu_daemon.config.onboard_tables import (
    AttitudeSection,
    AzimuthAxis,
    ElevationAxis,
    HoldRow,
    ImagingRow,
    PassSection,
    TargetRow,
)
from acu_daemon.config.outlet_tables import MetricsSection, MqttSection, RotctldSection
from acu_daemon.config.recording_tables import RecordingSection
from acu_daemon.config.satellite_tables import BrouwerSection, ElementsFileSection, LimitsSection
from acu_daemon.config.schedule_tables import MaintenanceSection
from acu_daemon.config.section import Section
from acu_daemon.config.station_day_tables import HooksSection, WindSection
from acu_daemon.config.station_tables import SafetySection, StationFile, TimeSection
from acu_daemon.config.tracking_tables import ReceiverSection, TrackingSection
from acu_daemon.config.web_tables import WebSection
from acu_daemon.edge.hooks import Hook

writer = load("write_configuration")
ROOT = Path(__file__).resolve().parents[1]
TABLES = [table for model, _ in writer.FILES.values() for table in writer.tables_of(model)]
KEYS = [pytest.param(key, id=f"{table.name}.{key.name}{table.kind}") for table in TABLES for key in table.keys]
WITHOUT_UNIT = {"eccentricity", "min_eccentricity", "max_eccentricity", "resume_share"}  # pure numbers
NUMBERS = (float, float | None)


def models_of(model: type[Section]) -> set[type[Section]]:
    below = {section for field in model.model_fields.values() for section in writer.sections_of(field)}
    return {model}.union(*(models_of(section) for section in below))


FIELDS = [
    pytest.param(model, name, id=f"{model.__name__}.{name}")
    for model in sorted(
        set.union(*(models_of(model) for model, _ in writer.FILES.values())), key=lambda kind: kind.__name__
    )
    for name in model.model_fields
]


def test_the_page_is_fresh() -> None:
    assert writer.PAGE.read_text(encoding="utf-8") == writer.page(), "run scripts/write_configuration.py"


@pytest.mark.parametrize(("model", "name"), FIELDS)
def test_every_key_and_table_has_a_description(model: type[Section], name: str) -> None:
    assert model.model_fields[name].description


@pytest.mark.parametrize("key", KEYS)
def test_every_key_of_the_page_has_all_that_an_operator_asks(key: Any) -> None:
    assert key.default
    assert key.range
    assert key.meaning
    assert key.decides, "a description reads: What it is.  Decides what."
    assert "|" not in key.meaning + key.decides + key.range


@pytest.mark.parametrize(("model", "name"), FIELDS)
def test_every_number_has_its_unit_in_its_name(model: type[Section], name: str) -> None:
    key = writer.key_of("", name, model.model_fields[name])
    if model.model_fields[name].annotation in NUMBERS and name not in WITHOUT_UNIT:
        assert key.unit


AXIS = {"min_deg": 0.0, "max_deg": 90.0, "max_rate_deg_s": 5.0, "max_acceleration_deg_s2": 5.0}
ACU = {"url": "tcp://localhost:1", "azimuth": AXIS, "elevation": AXIS}
HERE = {"latitude_deg": 0.0, "longitude_deg": 0.0, "height_m": 0.0}
OUT_OF_SAID: dict[str, tuple[type[Section], dict[str, Any]]] = {  # ranges that stand in words, and what is outside
    "AxisSection.max_deg": (AxisSection, AXIS | {"min_deg": 10.0, "max_deg": 10.0}),
    "ElevationSection.max_deg": (ElevationSection, AXIS | {"min_deg": 10.0, "max_deg": 10.0}),
    "AcuSection.url": (AcuSection, ACU | {"url": "http://localhost"}),
    "AcuSection.address": (AcuSection, ACU | {"address": "p"}),
    "TimeSection.earth_orientation": (TimeSection, {"earth_orientation": ""}),
    "MaintenanceSection.from_utc": (MaintenanceSection, {"from_utc": "noon", "to_utc": "2026-01-01T00:00:00Z"}),
    "MaintenanceSection.to_utc": (MaintenanceSection, {"from_utc": "2026-01-01T00:00:00Z", "to_utc": "2026-01-01"}),
    **{f"HooksSection.{hook}": (HooksSection, {str(hook): "a text"}) for hook in Hook},
    "HooksSection.user": (HooksSection, {"user": ""}),
    "WindSection.udp": (WindSection, {"udp": "4841"}),
    "WebSection.listen": (WebSection, {"listen": "localhost:8642"}),
    "RotctldSection.listen": (RotctldSection, {"listen": "localhost:4533"}),
    "MqttSection.url": (MqttSection, {"url": "http://broker"}),
    "MqttSection.topic": (MqttSection, {"topic": "a/#"}),
    "MqttSection.password_file": (MqttSection, {"password_file": ""}),
    "MqttSection.discovery_prefix": (MqttSection, {"discovery_prefix": "+"}),
    "MetricsSection.listen": (MetricsSection, {"listen": "localhost:9842"}),
    "WebSection.token_file": (WebSection, {"token_file": ""}),
    "WebSection.names": (WebSection, {"names": [""]}),
    "WindSection.file": (WindSection, {"file": ""}),
    "TrackingSection.low_water_s": (TrackingSection, {"low_water_s": 90.0, "horizon_s": 90.0}),
    "ElementsSourcesSection.source": (ElementsSourcesSection, {"source": "ftp://example.org/gp"}),
    "ElementsSourcesSection.store": (ElementsSourcesSection, {"store": ""}),
    "ElementsSourcesSection.login": (ElementsSourcesSection, {"login": ""}),
    "ElementsSourcesSection.ca_file": (ElementsSourcesSection, {"ca_file": ""}),
    "ReceiverSection.signal": (ReceiverSection, {"signal": "udp"}),
    "SafetySection.register_watchdog_s": (SafetySection, {"register_watchdog_s": 1.9}),
    "SafetySection.following_error_s": (SafetySection, {"following_error_s": 0.4}),
    "AtmosphereSection.pressure_hpa": (
        StationFile, {"station": HERE, "acu": ACU, "atmosphere": {"pressure_hpa": 800.0}},
    ),
    "AtmosphereSection.weather_udp": (AtmosphereSection, {"weather_udp": "4840"}),
    "EnvelopeSection.mask": (EnvelopeSection, {"mask": [[10.0, 5.0, 3.0]]}),
    "KeepOutSection.el_to_deg": (KeepOutSection, {"az_from_deg": 0.0, "az_to_deg": 9.0, "el_to_deg": -90.0}),
    "MountSection.ca_deg": (MountSection, {"ca_deg": -0.31}),
    "MountSection.npae_deg": (MountSection, {"npae_deg": 0.31}),
    "MountSection.an_deg": (MountSection, {"an_deg": 0.2, "aw_deg": -0.2}),
    "MountSection.aw_deg": (MountSection, {"aw_deg": 0.31}),
    "LimitsSection.max_semi_major_axis_km": (LimitsSection, {"max_semi_major_axis_km": 6500.0}),
    "LimitsSection.max_eccentricity": (LimitsSection, {"min_eccentricity": 0.2}),
    "LimitsSection.max_inclination_deg": (LimitsSection, {"min_inclination_deg": 90.0, "max_inclination_deg": 80.0}),
    "ElementsFileSection.file": (ElementsFileSection, {"kind": "tle", "file": 1}),
    "RecordingSection.send_to": (RecordingSection, {"send_to": ""}),
    "PassSection.from_utc": (PassSection, {"from_utc": "2026-01-01"}),
    "HoldRow.start_utc": (HoldRow, {"start_utc": "2026-01-01T00:00", "duration_s": 1.0}),
    "TargetRow.start_utc": (TargetRow, HERE | {"start_utc": 1.0, "duration_s": 1.0}),
    "ImagingRow.start_utc": (ImagingRow, {"start_utc": "now", "duration_s": 1.0}),
    "AttitudeSection.file": (AttitudeSection, {"file": ""}),
    "AzimuthAxis.max_rate_deg_s": (AzimuthAxis, {"max_rate_deg_s": 0.0}),
    "AzimuthAxis.max_acceleration_deg_s2": (AzimuthAxis, {"max_acceleration_deg_s2": 0.0}),
    "ElevationAxis.max_rate_deg_s": (ElevationAxis, {"max_rate_deg_s": -1.0}),
    "ElevationAxis.max_acceleration_deg_s2": (ElevationAxis, {"max_acceleration_deg_s2": -1.0}),
    "BrouwerSection.epoch_utc": (BrouwerSection, tomllib.loads(BROUWER)["elements"] | {"epoch_utc": "1989-01-31"}),
}  # fmt: skip


def test_every_range_in_words_is_tried() -> None:
    said = [param.id for param in FIELDS if (param.values[0].model_fields[param.values[1]].json_schema_extra or {})]
    assert sorted(OUT_OF_SAID) == sorted(said)


@pytest.mark.parametrize("key", OUT_OF_SAID)
def test_what_is_outside_of_a_range_in_words_is_refused_by_that_key(key: str) -> None:
    model, values = OUT_OF_SAID[key]
    with pytest.raises(ValidationError, match=re.escape(key.partition(".")[2])):
        model.model_validate(values)


def test_the_files_of_the_tests_hold_only_keys_of_the_page() -> None:
    known = {(table.name, key.name) for table in TABLES for key in table.keys}
    for text in (STATION, BROUWER, (ROOT / "config/station.toml").read_text()):
        for table, values in tomllib.loads(text).items():
            assert {(table, name) for name, value in values.items() if not isinstance(value, dict)} <= known

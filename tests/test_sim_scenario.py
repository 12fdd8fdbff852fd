"""Scenario files: what they say, and what a wrong one is told; the trace file."""

import csv
from pathlib import Path

import pytest

from acu_daemon.acu.commands import AcuMode
from acu_daemon.errors import ConfigError, UsageError
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.sim.scenario import AcuChoice, Encoder, Loss, ReceiverChoice, Scenario, SkyErrors, read_scenario
from acu_daemon.sim.trace import TraceRow, TraceWriter

FULL = """
[sky]
along_track_s = 2.5
delta_raan_deg = -0.05
[encoder]
azimuth_bias_deg = 0.05
elevation_bias_deg = -0.04
noise_deg = 0.03
[receiver]
peak_agc_db = 9
tracking_noise_deg = 0.01
[acu]
has_tilt = true
reply_latency_s = 0.002
mode = "stowed"
azimuth_deg = 120
elevation_deg = 90.0
[[loss]]
cause = "receiver"
start_s = 30
duration_s = 10
[[loss]]
cause = "fade"
depth_db = 4.0
from_utc = 2018-12-25T01:45:00Z
to_utc = "2018-12-25T01:45:30.5Z"
"""


def read(tmp_path: Path, text: str) -> Scenario:
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    return read_scenario(path)


def test_everything_a_scenario_says_is_read(tmp_path: Path) -> None:
    from_tai_s = tai_from_utc("2018-12-25T01:45:00Z")
    scenario = read(tmp_path, FULL)
    assert scenario == Scenario(
        SkyErrors(2.5, -0.05),
        Encoder(0.05, -0.04, 0.03),
        ReceiverChoice(peak_agc_db=9.0, tracking_noise_deg=0.01),
        AcuChoice(has_tilt=True, reply_latency_s=0.002, mode="stowed", azimuth_deg=120.0),
        (
            Loss("receiver", start_s=30.0, duration_s=10.0),
            Loss("fade", from_utc=from_tai_s, to_utc=from_tai_s + 30.5, depth_db=4.0),
        ),
    )
    assert scenario.losses[0].window_tai_s(1000.0) == (1030.0, 1040.0)
    assert scenario.losses[1].window_tai_s(1000.0) == (from_tai_s, from_tai_s + 30.5)


def test_an_empty_scenario_is_the_default(tmp_path: Path) -> None:
    assert read(tmp_path, "") == Scenario()


LOSS = '[[loss]]\ncause = "receiver"\n'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[weather]\n", "unknown table 'weather', expected sky, encoder"),
        ("loss = 3\n", r"loss is written \[\[loss\]\]"),
        ("sky = 3\n", "sky = 3, expected a table"),
        ("[sky]\nalong_s = 3\n", r"\[sky\] along_s is unknown, expected one of along_track_s"),
        ('[sky]\nalong_track_s = "3"\n', r"\[sky\] along_track_s = '3': expected a number"),
        ("[sky]\nalong_track_s = nan\n", "expected a number"),
        ("[sky]\nalong_track_s = true\n", "expected a number"),
        ("[encoder]\nnoise_deg = -1\n", r"\[encoder\] noise_deg = -1: expected 0 or more"),
        ("[acu]\nhas_tilt = 1\n", r"has_tilt = 1: expected true or false"),
        ("[acu]\nsector_bit = 0\n", r"sector_bit = 0: expected "),
        ('[acu]\nmode = "asleep"\n', "mode = 'asleep': expected one of 'standby', 'manual', 'remote', 'stowed'"),
        ("[[loss]]\nstart_s = 1\nduration_s = 1\n", r"\[loss 1\] cause is missing"),
        (LOSS + "start_s = 1\n", "loss 1: expected either start_s and duration_s"),
        (LOSS + "start_s = 1\nduration_s = 1\nto_utc = 2018-12-25T01:45:00Z\n", "expected either"),
        (LOSS + "start_s = 1\nduration_s = 0\n", "must end after it begins"),
        (LOSS + "start_s = 1\nduration_s = 1\ndepth_db = 3\n", "only a fade has one"),
        ('[[loss]]\ncause = "fade"\nstart_s = 1\nduration_s = 1\n', "a fade needs depth_db"),
        (LOSS + "from_utc = 2018-12-25T01:45:00\n", "expected a time like"),
        (LOSS + 'from_utc = "noon"\n', "from_utc = 'noon'"),
        ("[sky\n", "scenario.toml: "),
    ],
)
def test_a_wrong_scenario_is_told_file_key_value_and_what_was_expected(
    text: str, expected: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=expected) as error:
        read(tmp_path, text)
    assert "scenario.toml" in str(error.value)


def test_a_missing_scenario_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nothing\.toml"):
        read_scenario(tmp_path / "nothing.toml")


def test_the_trace_is_a_csv_with_empty_cells_where_there_is_no_satellite(tmp_path: Path) -> None:
    tai_s = tai_from_utc("2018-12-25T01:45:00Z")
    row = TraceRow(tai_s, 1, 2, 361, 2, None, None, None, AcuMode.REMOTE, False, 0.02, 3, 4, True, False)
    path = tmp_path / "trace.csv"
    with TraceWriter(path) as trace:
        trace.add(row)
    with path.open() as file:
        (cells,) = csv.DictReader(file)
    assert cells["utc"] == "2018-12-25T01:45:00.000Z"
    assert cells["encoder_az_deg"] == "361.00000"
    assert (cells["satellite_az_deg"], cells["beam_error_deg"]) == ("", "")
    assert (cells["mode"], cells["followed"], cells["signal"], cells["agc_db"]) == ("REMOTE", "1", "0", "0.02")


def test_a_trace_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--trace"):
        TraceWriter(tmp_path / "no" / "trace.csv")

"""What `passes` and `check` say of hills, keep-out zones and the sun, in words, as JSON and as a picture."""

import json
import shutil
from pathlib import Path

import pytest
from command_line import Done, acu_daemon

import acu_daemon.cli as cli
from acu_daemon.orbit.timescales import tai_from_utc

ENVELOPE = """
[envelope]
mask = [[0, 6], [40, 9], [120, 3], [150, 8], [200, 4], [235, 12], [262, 24], [285, 10], [330, 5]]
sun_policy = "avoid"
sun_keep_out_deg = 4.0

[[envelope.keep_out]]
name = "the mast"
az_from_deg = 100.0
az_to_deg = 112.0
el_to_deg = 25.0
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("envelope") / "config"
    shutil.copytree(Path(cli.__file__).parent / "demo_config", directory)
    station = directory / "station.toml"
    station.write_text(station.read_text() + ENVELOPE)
    return directory


def passes(config: Path, *more: object) -> Done:
    return acu_daemon("passes", "--config", config, "--from", "2026-08-24T00:00:00Z", *more)


def test_the_lines_of_the_passes_say_what_each_meets(config: Path) -> None:
    lines = passes(config).out.splitlines()[1:]
    notes = [line[78:].strip() for line in lines]
    assert [note.partition(" from ")[0] for note in notes if note] == [
        "0.3 deg",
        "behind the mask 181 s",
        "within the keep-out of the mast 68 s",
    ]
    assert next(note for note in notes if note).startswith("0.3 deg from the sun at 12:09:4")


def test_json_has_the_same_with_times(config: Path) -> None:
    found = json.loads(passes(config, "--json").out)
    [sun] = [one for row in found for one in row["sun"]]
    [hidden] = [one for row in found for one in row["hidden"]]
    [kept] = [one for row in found for one in row["keep_outs"]]
    assert tai_from_utc(sun["least_utc"]) == pytest.approx(tai_from_utc("2026-08-24T12:09:46Z"), abs=1.0)
    assert sun["least_deg"] == pytest.approx(0.33, abs=0.05)
    assert hidden["duration_s"] == pytest.approx(181.0, abs=1.0)
    assert (kept["name"], kept["duration_s"]) == ("the mast", pytest.approx(68.0, abs=1.0))


def test_the_picture_has_them_all(config: Path, tmp_path: Path) -> None:
    picture = tmp_path / "sky.svg"
    assert passes(config, "--plot", picture).code == 0
    text = picture.read_text()
    assert text.count("<!-- demo-1 08-2") == 5
    for what in ("the mast", "behind the mask, or below 5°", "the sun in each pass, 4° (avoid)"):
        assert f"<!-- {what} -->" in text
    refused = passes(config, "--plot", tmp_path / "sky.txt")
    assert (refused.code, ".png" in refused.err) == (2, True)


def test_check_says_what_bounds_the_beam_and_what_the_next_pass_meets(config: Path) -> None:
    said = acu_daemon("check", "--config", config, "--at", "2026-08-24T11:00:00Z").out
    [bounds] = [line for line in said.splitlines() if "envelope" in line]
    assert bounds.endswith("a mask of 3 to 24 deg; kept out of the mast; kept 4 deg from the sun")
    [sun] = [line for line in said.splitlines() if "demo-1: sun" in line]
    assert sun.startswith("WARN") and sun.endswith("; it is led around")

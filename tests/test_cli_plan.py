"""`acu-daemon plan`: a pass as it will be flown, in words, data and a picture."""

import json
import shutil
from pathlib import Path

import pytest
from command_line import acu_daemon

import acu_daemon.cli as cli

AT = "2026-08-18T12:30:00Z"


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """The demo's station with a range that ends in the north, and a mask."""
    copied = shutil.copytree(Path(cli.__file__).parent / "demo_config", tmp_path / "config")
    station = copied / "station.toml"
    text = (
        station.read_text().replace("min_deg = -270.0", "min_deg = 0.0").replace("max_deg = 270.0", "max_deg = 360.0")
    )
    station.write_text(text + "\n[envelope]\nmask = [[0, 5], [60, 12], [200, 20], [240, 6]]\n")
    return copied


def test_it_tells_how_a_pass_over_the_zenith_is_flown_between_stops(config: Path, tmp_path: Path) -> None:
    data, picture = tmp_path / "plan.json", tmp_path / "plan.svg"
    done = acu_daemon(
        "plan",
        "--config",
        str(config),
        "--satellite",
        "demo-1",
        "--at",
        AT,
        "--json",
        str(data),
        "--plot",
        str(picture),
    )
    assert done.code == 0, done.err
    told = dict(line.split(maxsplit=1) for line in done.out.splitlines()[1:])
    assert "up to 89.84 deg" in told["pass"]
    assert "holds the whole pass" in told["turn"]
    assert "the other way round" in told["zenith"]
    assert "unwinding" not in told
    plan = json.loads(data.read_text())
    assert plan["unwindings"] == []
    assert plan["zenith"]["largest_error_deg"] == pytest.approx(1.14, abs=0.03)
    assert plan["out_of_beam_s"] == pytest.approx(plan["zenith"]["lost_s"], abs=0.3)
    assert min(one["antenna_az_deg"] for one in plan["path"]) >= 0.0
    assert max(one["antenna_az_deg"] for one in plan["path"]) <= 360.0
    assert picture.read_text().startswith("<?xml")


def test_a_picture_of_no_known_kind_is_refused_before_the_work(config: Path) -> None:
    done = acu_daemon("plan", "--config", str(config), "--satellite", "demo-1", "--at", AT, "--plot", "plan.txt")
    assert done.code == 2
    assert "--plot plan.txt: expected a name that ends in" in done.err

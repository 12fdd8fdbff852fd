"""The picture of the rooms is that of the code."""

from pathlib import Path

import pytest
from script_modules import load

ROOT = Path(__file__).resolve().parents[1]
rooms = load("draw_rooms")

CONTRACT = """
[[tool.importlinter.contracts]]
name = "rooms"
layers = ["acu_daemon.cli", "acu_daemon.edge : control", "model"]
"""


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A small house: cli imports edge and control, both import the model; nobody has placed the attic."""
    (tmp_path / "pyproject.toml").write_text(CONTRACT)
    files = {
        "cli.py": "from acu_daemon import control, model\nimport acu_daemon.edge.link\n",
        "edge/link.py": "from acu_daemon.model import Reading\n",
        "control/__init__.py": '"""The decision.  Pure."""\n',
        "control/tick.py": "from acu_daemon.model import Reading\n",
        "control/safety/arming.py": "",
        "control/safety/__init__.py": "",
        "model.py": "import math\n",
        "attic.py": "",
    }
    for name, text in files.items():
        path = tmp_path / "acu_daemon" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


@pytest.mark.long
def test_the_picture_of_the_rooms_is_that_of_the_code() -> None:
    drawn = (ROOT / rooms.PICTURE).read_text(encoding="utf-8")
    assert drawn == rooms.draw(rooms.read_house(ROOT)), "draw it anew: scripts/draw_rooms.py"


def test_rooms_floors_and_imports_are_read_from_the_code(house: Path) -> None:
    seen = rooms.read_house(house)
    assert seen.layers == [["attic"], ["cli"], ["edge", "control"], ["model"]]
    assert seen.imports == {
        "attic": set(),
        "cli": {"edge", "control", "model"},
        "edge": {"model"},
        "control": {"model"},
        "model": set(),
    }
    assert seen.floors == {"control": [("", ["tick"]), ("safety", ["arming"])]}
    assert seen.says["attic"] == "(in no layer) "


def test_an_import_that_a_chain_of_others_implies_has_no_arrow(house: Path) -> None:
    assert rooms.needed(rooms.read_house(house).imports) == {
        ("cli", "edge"),
        ("cli", "control"),
        ("edge", "model"),
        ("control", "model"),
    }


def test_a_new_import_changes_the_picture(house: Path) -> None:
    before = rooms.draw(rooms.read_house(house))
    (house / "acu_daemon" / "edge" / "link.py").write_text("from acu_daemon.control.tick import tick\n")
    assert rooms.draw(rooms.read_house(house)) != before

"""The table of what the tests reach, and its floor."""

import json
from pathlib import Path

import pytest
from script_modules import load

floor = load("coverage_floor")


def seen(name: str, run: list[int], missed: list[int], ways: list[list[int]], missed_ways: list[list[int]]) -> dict:
    parts = {"executed_lines": run, "missing_lines": missed, "executed_branches": ways, "missing_branches": missed_ways}
    return {name: parts}


@pytest.fixture
def reports(tmp_path: Path) -> list[Path]:
    """Two runs: each reaches another line and another branch of one file."""
    files = [
        seen("acu_daemon/orbit/look.py", [1, 2], [3, 4], [[1, 2]], [[1, 3]])
        | seen("acu_daemon/model.py", [1], [], [], []),
        seen("acu_daemon/orbit/look.py", [1, 3], [2, 4], [[1, 3]], [[1, 2]]),
    ]
    paths = [tmp_path / f"{k}.json" for k in range(len(files))]
    for path, one in zip(paths, files, strict=True):
        path.write_text(json.dumps({"files": one}))
    return paths


def test_runs_are_taken_together_by_room(reports: list[Path]) -> None:
    rooms = floor.read(reports)
    assert set(rooms) == {"", "orbit", "model"}
    assert rooms["orbit"].percent("lines") == 75.0
    assert rooms["orbit"].percent("branches") == 100.0
    assert rooms[""].percent("lines") == 80.0
    assert rooms["model"].percent("branches") == 100.0, "nothing to miss"


def test_what_falls_below_the_floor_is_named_and_ends_the_run(
    reports: list[Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(floor, "REAL_PASSES", tmp_path)
    monkeypatch.setattr(floor, "FLOOR_PERCENT", {"lines": 80.0, "branches": 100.0})
    assert floor.main([str(path) for path in reports]) == 0
    monkeypatch.setattr(floor, "FLOOR_PERCENT", {"lines": 80.1, "branches": 100.0})
    assert floor.main([str(path) for path in reports]) == 1
    assert "lines: 80.0 % is below the floor of 80.1 %" in capsys.readouterr().out


def test_without_the_real_passes_the_floor_is_told_and_does_not_count(
    reports: list[Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(floor, "REAL_PASSES", tmp_path / "nowhere")
    monkeypatch.setattr(floor, "FLOOR_PERCENT", {"lines": 99.0})
    assert floor.main([str(path) for path in reports]) == 0
    assert "below the floor" in capsys.readouterr().out

"""One name, one thing in the whole house: no two files of the package, and no two classes, are called alike."""

import ast
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "acu_daemon"
MODULES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.name != "__init__.py"]


def twice(named: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """The names that more than one place has."""
    places: defaultdict[str, list[str]] = defaultdict(list)
    for name, place in named:
        places[name].append(place)
    return {name: found for name, found in places.items() if len(found) > 1}


def test_no_two_files_of_the_package_have_the_same_name() -> None:
    assert len(MODULES) > 100
    assert twice((path.name, str(path.relative_to(PACKAGE))) for path in MODULES) == {}


def test_no_two_classes_of_the_package_have_the_same_name() -> None:
    classes = [
        (node.name, str(path.relative_to(PACKAGE)))
        for path in MODULES
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]
    assert len(classes) > 100
    assert twice(classes) == {}


def test_a_name_that_is_given_twice_is_seen() -> None:
    assert twice([("hands", "cli"), ("run", "cli"), ("hands", "daemon")]) == {"hands": ["cli", "daemon"]}

"""README's table of promises names tests that exist."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROWS = re.findall(r"^\| P(\d+) \|.*\|([^|]*)\|$", (ROOT / "README.md").read_text(), re.MULTILINE)


def names_of(promise: str, module: str) -> list[str]:
    """Names of a module's tests that carry the promise's id."""
    tree = ast.parse((ROOT / "tests" / f"{module}.py").read_text())
    names = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    return [name for name in names if name.startswith("test_") and f"_p{promise}_" in name]


def test_all_ten_promises_are_printed() -> None:
    assert [number for number, _ in ROWS] == [str(k) for k in range(1, 11)]


@pytest.mark.parametrize(("promise", "cell"), ROWS)
def test_every_module_named_beside_a_promise_has_tests_of_it(promise: str, cell: str) -> None:
    modules = re.findall(r"`(test_\w+)`", cell)
    assert modules
    for module in modules:
        assert names_of(promise, module), f"{module} has no test of P{promise}"

"""README's table of promises names tests that exist."""

import ast
import json
import re
import shlex
from pathlib import Path

import pytest
from command_line import acu_daemon

from acu_daemon.orbit.timescales import tai_from_utc

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


def test_the_two_commands_of_the_rehearsal_have_one_clock_and_catch_a_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their session itself, with stops and starts, is flown by test_real_processes."""
    monkeypatch.chdir(ROOT)
    lines = re.findall(r"^acu-daemon ((?:fake-acu|run) .* --at .*)$", (ROOT / "README.md").read_text(), re.MULTILINE)
    fake_acu, run = ([word for word in shlex.split(line) if not word.startswith("#")] for line in lines[:2])
    assert (fake_acu[0], run[0]) == ("fake-acu", "run")
    for words in (fake_acu, run):
        said = acu_daemon(words[0], "--help").out
        assert all(word in said for word in words if word.startswith("--"))
    common = fake_acu[1:]
    assert run[1 : len(common) + 1] == common
    given = dict(zip(run[1::2], run[2::2], strict=True))
    where = ("--config", given["--config"], "--satellite", given["--satellite"])
    first = json.loads(acu_daemon("passes", *where, "--from", given["--at"], "--json").out)[0]
    assert tai_from_utc(first["rise_utc"]) < tai_from_utc(given["--at"]) + float(given["--duration"])

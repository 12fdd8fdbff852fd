"""Each part of the decision's memory is made anew by its owner alone (control.state says who that is)."""

import ast
import re
from collections import defaultdict
from dataclasses import fields
from functools import cache
from pathlib import Path

import acu_daemon
from acu_daemon.control import state as state_module
from acu_daemon.control.state import ControlState

PACKAGE = Path(acu_daemon.__file__).parent
STATE = "control.state"


@cache
def owners() -> dict[str, str]:
    """Module by part: as the docstring of its class says, or the line of its field."""
    source = Path(state_module.__file__).read_text()
    beside = dict(re.findall(r"^    (\w+): \w+ = .*# owner: (\S+)$", source, re.MULTILINE))
    found = {}
    for part in fields(ControlState):
        said = re.search(r"Owner: ([\w.]+)\.", type(part.default).__doc__ or "")
        found[part.name] = beside.get(part.name) or (said.group(1) if said else "")
    return found


@cache
def modules() -> dict[str, ast.Module]:
    """Those that know the memory, by name."""
    read = {path.relative_to(PACKAGE): path.read_text() for path in sorted(PACKAGE.rglob("*.py"))}
    knowing = {path: text for path, text in read.items() if f"{STATE} import" in text}
    return {".".join(path.with_suffix("").parts): ast.parse(text) for path, text in knowing.items()}


def writers() -> dict[str, set[str]]:
    """The modules that put a part into a memory, or make a value of its class, by part; "all": that make a memory."""
    part_of = {type(part.default).__name__: part.name for part in fields(ControlState)}
    own = {"TurnWatch", "EncoderWatch"}  # their modules reckon with them, and keep none
    found: dict[str, set[str]] = defaultdict(set)
    for module, tree in modules().items():
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)]
        for call in calls:
            name, given = call.func.id, [keyword.arg for keyword in call.keywords]
            if name == "ControlState" and (call.args or given):
                found["all"].add(module)
            elif name == "with_parts":
                for part in given:
                    found[str(part)].add(module)
            elif name in part_of and name not in own:
                found[part_of[name]].add(module)
    return found


def test_every_part_names_an_owner_that_exists() -> None:
    assert set(owners().values()) <= set(modules())


def test_each_part_is_made_anew_by_its_owner_alone() -> None:
    found = writers()
    assert {part: found[part] for part in owners()} == {part: {owner} for part, owner in owners().items()}


def test_nobody_makes_a_memory_with_parts_of_his_own() -> None:
    assert writers()["all"] == set()

"""The receivers of docs/schedule.md, started as the hooks that stand there, with stand-ins for the programs."""

import asyncio
import json
import re
import tomllib
from pathlib import Path

import pytest

from acu_daemon.edge.hooks import Hook, Hooks

pytestmark = pytest.mark.realtime
PAGE = Path(__file__).resolve().parents[1] / "docs" / "schedule.md"
PATIENCE_S = 60.0
RECEIVER = """
import json, signal, sys, time
from pathlib import Path

out = Path({out!r})
def close(*_):
    (out / {name!r}).write_text(json.dumps(sys.argv[1:]))
    sys.exit(0)
signal.signal(signal.SIGTERM, close)
(out / ({name!r} + ".ready")).touch()
while True:
    time.sleep(0.1)
"""


def examples() -> list[dict[Hook, list[str]]]:
    text = PAGE.read_text()
    section = text[text.index("### Receivers") : text.index("## States and reasons")]
    blocks = re.findall(r"```toml station\n(.*?)```", section, re.DOTALL)
    return [{Hook(name): command for name, command in tomllib.loads(one)["hooks"].items()} for one in blocks]


async def until(path: Path) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not path.exists():
            await asyncio.sleep(0.02)


@pytest.mark.parametrize("number", range(len(examples())))
async def test_each_is_started_told_of_the_pass_and_ended_with_it(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = f"receiver-{number}"
    program = RECEIVER.format(out=str(tmp_path), name=name)
    (tmp_path / "telemetry.py").write_text(program)
    satdump = tmp_path / "satdump"
    satdump.write_text(f"#!/usr/bin/env python3\n{program}")
    satdump.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/local/bin:/usr/bin:/bin", prepend=":")
    places = {"/srv/recordings": str(tmp_path), "/usr/local/lib/receivers": str(tmp_path)}
    commands = {hook: [_moved(word, places) for word in command] for hook, command in examples()[number].items()}
    hooks = Hooks(commands, PATIENCE_S)
    hooks.call(Hook.BEFORE_PASS, {"satellite": "noaa-20"})
    hooks.call(Hook.DURING_PASS, {"satellite": "noaa-20"})
    await until(tmp_path / f"{name}.ready")
    hooks.end_during()
    await until(tmp_path / name)
    hooks.call(Hook.AFTER_PASS, {"satellite": "noaa-20", "state": "done"})
    await asyncio.gather(*hooks._running, return_exceptions=True)
    assert [one for one in hooks.take_results() if not one.is_good] == []
    arguments = json.loads((tmp_path / name).read_text())
    assert "/srv" not in " ".join(arguments)
    assert any(str(tmp_path) in word for word in arguments)
    told = [json.loads(path.read_text()) for path in tmp_path.glob("*.json")]
    assert [one["satellite"] for one in told] == ["noaa-20"]


def _moved(word: str, places: dict[str, str]) -> str:
    for place, other in places.items():
        word = word.replace(place, other)
    return word

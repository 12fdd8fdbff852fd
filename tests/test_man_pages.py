"""Man pages are the help: every command has one, and no line of the help is taken for a request of troff."""

import re
from pathlib import Path

import pytest
from script_modules import load

from acu_daemon.cli.app import COMMANDS, GROUPS

pages = load("write_man_pages")


@pytest.mark.parametrize("words", [[], ["wait"], ["elements"], ["elements", "show"]])
def test_a_page_has_name_synopsis_and_the_whole_help(words: list[str]) -> None:
    text = pages.help_of(words)
    page = pages.man_page("-".join(["acu-daemon", *words]), text, "1.2.3")
    name, what = re.findall(r"^\.SH NAME\n(\S+) \\- (.+)$", page, re.MULTILINE)[0]
    assert name.replace("\\-", "-") == "-".join(["acu-daemon", *words])
    assert what[-1] not in ".,"
    assert "[OPTIONS]" in page.split(".SH DESCRIPTION")[0]
    printed = page.replace("\\-", "-").replace("\\&", "").replace("\\e", "\\")
    assert all(line in printed for line in text.splitlines()[1:])


def test_lines_that_troff_would_take_for_requests_are_kept() -> None:
    assert pages._escaped(".toml and 'x' -a \\b") == "\\&.toml and 'x' \\-a \\eb"
    assert pages._escaped("'quoted'") == "\\&'quoted'"


def test_every_command_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "help_of", lambda words: "Usage: acu-daemon x\n\n  Does it.\n")
    monkeypatch.setattr("sys.argv", ["write_man_pages.py", str(tmp_path), "1"])
    monkeypatch.setenv("COLUMNS", "80")
    pages.main()
    count = 1 + len(COMMANDS) + len(GROUPS) + sum(len(group.commands) for group in GROUPS.values())
    assert len(list(tmp_path.glob("acu-daemon*.1"))) == count

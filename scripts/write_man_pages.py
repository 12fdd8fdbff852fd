"""Writes man pages from the help: acu-daemon.1, and acu-daemon-COMMAND.1 for every command.

scripts/write_man_pages.py DIR VERSION
"""

import os
import sys
from pathlib import Path

from typer.testing import CliRunner

from acu_daemon.cli.app import COMMANDS, GROUPS, make_app

COLUMNS = "80"


def main() -> None:
    """Write a page for each."""
    directory, version = Path(sys.argv[1]), sys.argv[2]
    names = [[], *([name] for name in COMMANDS), *([name] for name in GROUPS)]
    names += [[group, command] for group in GROUPS for command in GROUPS[group].commands]
    os.environ["COLUMNS"] = COLUMNS
    for words in names:
        page = "-".join(["acu-daemon", *words])
        (directory / f"{page}.1").write_text(man_page(page, help_of(words), version), encoding="utf-8")


def help_of(words: list[str]) -> str:
    """The help of a command, as it is printed."""
    done = CliRunner().invoke(make_app(words), [*words, "--help"], prog_name="acu-daemon", terminal_width=int(COLUMNS))
    assert done.exit_code == 0, done.output
    return done.output


def man_page(page: str, text: str, version: str) -> str:
    """A page in man(7): the name with its first sentence, the synopsis, and the rest as it is printed."""
    lines = text.strip().splitlines()
    usage = lines[0].partition(": ")[2]
    paragraph = text.strip().split("\n\n")[1]
    what = " ".join(paragraph.split()).split(". ")[0].rstrip(".:")
    body = "\n".join(_escaped(line) for line in lines[1:]).strip("\n")
    return (
        f'.TH {page.upper()} 1 "" "acu-daemon {version}" "User Commands"\n.SH NAME\n{_escaped(f"{page} - {what}")}\n'
        f".SH SYNOPSIS\n.B {_escaped(usage)}\n.SH DESCRIPTION\n.nf\n{body}\n.fi\n"
        ".SH SEE ALSO\nThe pages of the project: README.md, docs/tutorial.md, docs/service.md, docs/status.md.\n"
    )


def _escaped(line: str) -> str:
    """Of a line for troff: backslashes, hyphens that stay hyphens, and no dot or quote that would begin a request."""
    line = line.replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{line}" if line[:1] in (".", "'") else line


if __name__ == "__main__":
    main()

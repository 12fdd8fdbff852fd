"""The documents: links and anchors lead somewhere, nothing outside the project is cited, marked examples hold."""

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from config_files import BROUWER, STATION

from acu_daemon.config.load import parse
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.station_tables import StationFile
from acu_daemon.sim.scenario import read_scenario

ROOT = Path(__file__).resolve().parents[1]
PATIENCE_S = 60.0  # for a hang
PAGES = sorted(
    path.relative_to(ROOT)
    for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("config/**/*.md"))
    if path.is_file()
)
PICTURES = sorted(path.relative_to(ROOT) for path in ROOT.glob("docs/**/*.svg"))
SOURCES = sorted(
    path.relative_to(ROOT)
    for folder in ("acu_daemon", "scripts", "tests", "config", ".ci")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".py", ".sh", ".toml", ".service", ""} and path.is_file() and path != Path(__file__).resolve()
)

FENCE = re.compile(r"^( *)(`{3,})([^\n`]*)\n(.*?)^\1\2 *$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(?<!\\)!?\[[^\]]*\]\(\s*<?([^)<>\s]+)>?(?:\s+\"[^\"]*\")?\s*\)")
HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
ELSEWHERE = ("http://", "https://", "mailto:")
CITED_FILE = re.compile(
    r"(?<![\w./-])(?:docs/[\w./-]*\w\.(?:md|json|png|svg)|(?:acu_daemon|scripts|tests)/[a-z\d_/]+\.(?:py|sh))\b"
)
NAMED_PATH = re.compile(r"`((?:acu_daemon|config|docs|scripts|tests)/[\w./@-]+)(?:::[^`]*)?`")
CITED_SECTION = re.compile(r"(?<![\w./-])docs/([\w/-]+\.md)`?,\s+(?=[A-Z][a-z])(.{1,60})")
CITED_DECISION = re.compile(r"\b[Dd]ecisions?\s+(\d{4})(?:\s+and\s+(\d{4}))?|\bdecisions/(\d{4})\b")
OUTSIDE = {
    "the interface document by its old name": re.compile(r"\bICD\b|\bicd/"),
    "the design": re.compile(r"\b[Dd]esign,? sections?\b|\bdesign\.md\b"),
    "a paper by a number": re.compile(r"\b[Ss]eeds? 00\d\b"),
    "a folder beside the project": re.compile(
        r"shared/(?:icd|reference|seeds|hooks|style)|(?<![\w/.])reference/\w+\.md"
    ),
    "an issue by its number": re.compile(r"\b[Ii]ssues? #?\d+\b"),
}


@cache
def text_of(page: Path) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def prose_of(text: str) -> str:
    """Without fenced blocks and code spans."""
    return re.sub(r"(`+)(?!`).+?(?<!`)\1(?!`)", "", FENCE.sub("", text))


def slug(heading: str) -> str:
    """The anchor that a forge makes of a heading."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")


def headings_of(text: str) -> list[str]:
    return HEADING.findall(FENCE.sub("", text))


def anchors_of(text: str) -> set[str]:
    """Those of the headings, the second of a name with -1, and explicit ones."""
    found: set[str] = set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))
    for heading in headings_of(text):
        anchor, count = slug(heading), 0
        while (numbered := f"{anchor}-{count}" if count else anchor) in found:
            count += 1
        found.add(numbered)
    return found


def dead_links(page: Path, text: str) -> list[str]:
    """Links of a page of the project that lead nowhere."""
    dead = []
    for target in LINK.findall(prose_of(text)):
        if target.startswith(ELSEWHERE):
            continue
        file, _, anchor = target.partition("#")
        goal = (ROOT / page.parent / file).resolve() if file else ROOT / page
        if not goal.exists() or not goal.is_relative_to(ROOT):
            dead.append(f"{target}: no such file in the project")
        elif anchor and (goal.suffix != ".md" or anchor not in anchors_of(text if not file else goal.read_text())):
            dead.append(f"{target}: no such heading")
    return dead


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_every_link_and_anchor_of_a_page_leads_somewhere_in_the_project(page: Path) -> None:
    assert dead_links(page, text_of(page)) == []


@pytest.mark.parametrize(
    ("target", "is_dead"),
    [
        ("docs/protocol.md", False),
        ("docs/protocol.md#time-tags", False),
        ("#acu-daemon", False),
        ("https://example.org/nowhere", False),
        ("docs/nowhere.md", True),
        ("docs/protocol.md#no-such-heading", True),
        ("#nowhere", True),
        ("../elsewhere.md", True),
    ],
)
def test_a_dead_link_is_seen(target: str, is_dead: bool) -> None:
    assert bool(dead_links(Path("README.md"), f"# acu-daemon\n\n[one]({target})\n")) == is_dead


@pytest.mark.parametrize(
    ("heading", "anchor"),
    [("Time tags", "time-tags"), ("2.4.3: errors of a and i", "243-errors-of-a-and-i"), ("`full`, ours", "full-ours")],
)
def test_an_anchor_is_that_of_the_forge(heading: str, anchor: str) -> None:
    assert slug(heading) == anchor


# what comments and pages cite


@cache
def said_in(path: Path) -> str:
    """A comment that goes on in the next line is one text."""
    return re.sub(r"\n[ \t]*#+", "\n", text_of(path)) if path.suffix != ".md" else text_of(path)


def outside_citations(text: str) -> Iterator[str]:
    """What a text cites that a stranger has not got."""
    for what, pattern in OUTSIDE.items():
        for found in pattern.finditer(text):
            yield f"{what}: {found.group()!r}"


def wrong_citations(text: str) -> Iterator[str]:
    """Documents, sections and decisions that are cited and are not there."""
    for name in (*CITED_FILE.findall(text), *NAMED_PATH.findall(text)):
        if not (ROOT / name).exists():
            yield f"{name}: no such file"
    for name, after in CITED_SECTION.findall(re.sub(r"\s+", " ", text)):
        page = ROOT / "docs" / name
        if page.exists() and not after.startswith(tuple(headings_of(page.read_text()))):
            yield f"docs/{name}, {after[:30]}: no such section"
    for numbers in CITED_DECISION.findall(text):
        for number in filter(None, numbers):
            if not any((ROOT / "docs" / "decisions").glob(f"{number}-*.md")):
                yield f"decision {number}: no such record"


@pytest.mark.parametrize("path", [*PAGES, *PICTURES, *SOURCES], ids=str)
def test_nothing_cites_what_is_not_in_the_project(path: Path) -> None:
    said = said_in(path)
    assert [*outside_citations(said), *wrong_citations(said)] == []


@pytest.mark.parametrize(
    "text",
    [
        "the I" + "CD, section 3",
        "as I" + "CD section 6 says",
        "desi" + "gn section 4",
        "../sha" + "red/icd/sa3842.md",
        "se" + "ed 001, 2.5",
        "iss" + "ue 12",
        "docs/nowhere.md",
        "docs/protocol.md, Nowhere",
        "`acu_daemon/nowhere.py`",
        "decision 9999",
    ],
)
def test_a_citation_of_what_is_not_there_is_seen(text: str) -> None:
    assert [*outside_citations(text), *wrong_citations(text)] != []


@pytest.mark.parametrize(
    "text",
    [
        "(docs/protocol.md,\n    Time tags)",
        "docs/protocol.md, Link; and",
        "decision 0034",
        "../sha" + "red/data/passes",
    ],
)
def test_a_citation_of_what_is_there_passes(text: str) -> None:
    assert [*outside_citations(text), *wrong_citations(text)] == []


# examples


def examples(*words: str) -> list[Any]:
    """Fenced blocks by the words behind their fence, with the place they stand at."""
    found = []
    for page in PAGES:
        text = text_of(page)
        for block in FENCE.finditer(text):
            if tuple(block[3].split()) == words:
                line = text[: block.start()].count("\n") + 1
                found.append(
                    pytest.param(re.sub(f"^{block[1]}", "", block[4], flags=re.MULTILINE), id=f"{page}:{line}")
                )
    return found


def merged(base: dict[str, Any], fragment: dict[str, Any]) -> dict[str, Any]:
    """A file with what a fragment says in the place of its own."""
    both = dict(base)
    for key, value in fragment.items():
        under = both.get(key)
        both[key] = merged(under, value) if isinstance(value, dict) and isinstance(under, dict) else value
    return both


def test_every_example_of_toml_says_of_which_file_it_is() -> None:
    assert examples("toml") == []
    assert all(examples("toml", kind) for kind in ("station", "satellite", "scenario"))


@pytest.mark.parametrize("text", examples("toml", "station"))
def test_an_example_of_the_station_is_taken(text: str) -> None:
    parse(StationFile, Path("station.toml"), merged(tomllib.loads(STATION), tomllib.loads(text)))


@pytest.mark.parametrize("text", examples("toml", "satellite"))
def test_an_example_of_a_satellite_is_taken(text: str) -> None:
    given = tomllib.loads(text)
    base = {} if "elements" in given else tomllib.loads(BROUWER)
    parse(SatelliteFile, Path("satellite.toml"), merged(base, given))


@pytest.mark.parametrize("text", examples("toml", "scenario"))
def test_an_example_of_a_scenario_is_taken(text: str, tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    read_scenario(path)


@pytest.mark.long
@pytest.mark.parametrize("text", examples("sh", "run"))
def test_an_example_of_the_shell_runs(text: str) -> None:
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", text],
        cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=PATIENCE_S,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr

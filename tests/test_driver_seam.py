"""Nothing above the driver knows which ACU it has: no import of a driver, and no word of the SA-3842."""

import ast
import re
from pathlib import Path

import pytest

import acu_daemon

PACKAGE = Path(acu_daemon.__file__).parent
ABOVE = ("acu", "assist", "control", "daemon", "edge", "orbit", "report", "schedule", "cli")
COMPOSITION = {
    "cli/demo.py",  # a simulated SA-3842 without a daemon stands beside the one with it
    "cli/fake_acu.py",
    "cli/rehearse.py",  # the simulated one is chosen for a rehearsal
    "cli/virtual_pass.py",
    "cli/virtual_station.py",
}
DRIVERS = re.compile(r"acu_daemon\.drivers")
WORDS = re.compile(
    r"SA-?3842|(?<!\.1:)3842|[Nn]ibble|\b[0-9A-F]{2}h\b|WRITE AND STATUS|STATUS POLL|(?:MODE|BACKUP) SELECT"
    r"|FAULT DETAIL"
    r"|(?:WRITE|READ) (?:REGISTERS|PARAMETER)|CLEAR CHANGE|sector preference|parameter [STAWRPM]\b|\bAQT\b|\b[RP]MT\b"
    r"|16[- ]bits?\b|\bn[1-8]\.b[0-3]|\bLSB|docs/protocol\.md|tilt_code|\bN(?:AK|ak)\b|WriteAndPoll|SABus",
)


def modules() -> list[str]:
    found = [path.relative_to(PACKAGE).as_posix() for path in sorted(PACKAGE.rglob("*.py"))]
    return [name for name in found if name.split("/")[0] in ABOVE and name not in COMPOSITION]


def known(source: str) -> list[str]:
    """The words of the SA-3842 in names, texts and comments of a module, and the drivers that it imports."""
    ast.parse(source)
    return [match.group() for pattern in (DRIVERS, WORDS) for match in pattern.finditer(source)]


def test_many_modules_stand_above_the_driver() -> None:
    assert len(modules()) > 150


@pytest.mark.parametrize("name", modules())
def test_a_module_above_the_driver_knows_no_word_of_the_sa3842(name: str) -> None:
    assert known((PACKAGE / name).read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "source",
    ["from acu_daemon.drivers.sa3842 import codec", "LSB_DEG = 0.005", "x = 'MODE SELECT'", "# n4.b1", "# a NAK"],
)
def test_a_word_of_the_sa3842_is_seen(source: str) -> None:
    assert known(source)

"""The lines of Hamlib's rotctld protocol, and of EasyComm II: what a client says, and how it is answered.  Pure.

A command is a letter or `\\long_name` with its values; `+` before it (also `;`, `|` and `,`) asks for the extended
form, which names what it answers and ends in RPRT.  Errors are Hamlib's numbers, none below -17: a client has an
error table of 18 entries.
"""

import re
from dataclasses import dataclass
from enum import Enum, auto
from math import isfinite

LONGEST_LINE_BYTES = 200
OK, INVALID, NOT_IMPLEMENTED, IO_ERROR, REJECTED = 0, -1, -4, -6, -9
NUMBER = re.compile(rb"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?")


class RotctlVerb(Enum):
    """What a client wants."""

    GET_POSITION = auto()
    SET_POSITION = auto()
    STOP = auto()
    PARK = auto()
    GET_INFO = auto()
    DUMP_STATE = auto()
    DUMP_CAPS = auto()
    STATUS = auto()
    QUIT = auto()
    EASYCOMM_GET = auto()
    EASYCOMM_SET = auto()  # nothing is answered
    EASYCOMM_STOP = auto()
    NOTHING = auto()
    NOT_THERE = auto()  # a command of Hamlib's that this antenna has not
    WRONG = auto()


@dataclass(frozen=True, slots=True)
class Command:
    """A line as it was understood.  name: in the extended form; mark: its separator, empty in the plain form."""

    verb: RotctlVerb
    values: tuple[float, ...] = ()
    name: str = ""
    mark: str = ""


_COMMANDS = {
    "p": (RotctlVerb.GET_POSITION, "get_pos", 0),
    "P": (RotctlVerb.SET_POSITION, "set_pos", 2),
    "S": (RotctlVerb.STOP, "stop", 0),
    "K": (RotctlVerb.PARK, "park", 0),
    "R": (RotctlVerb.NOT_THERE, "reset", 1),
    "M": (RotctlVerb.NOT_THERE, "move", 2),
    "C": (RotctlVerb.NOT_THERE, "set_conf", 2),
    "U": (RotctlVerb.NOT_THERE, "set_func", 2),
    "u": (RotctlVerb.NOT_THERE, "get_func", 1),
    "V": (RotctlVerb.NOT_THERE, "set_level", 2),
    "v": (RotctlVerb.NOT_THERE, "get_level", 1),
    "X": (RotctlVerb.NOT_THERE, "set_parm", 2),
    "x": (RotctlVerb.NOT_THERE, "get_parm", 1),
    "w": (RotctlVerb.NOT_THERE, "send_cmd", 1),
    "s": (RotctlVerb.STATUS, "get_status", 0),
    "_": (RotctlVerb.GET_INFO, "get_info", 0),
    "1": (RotctlVerb.DUMP_CAPS, "dump_caps", 0),
    "q": (RotctlVerb.QUIT, "quit", 0),
    "Q": (RotctlVerb.QUIT, "quit", 0),
}
_LONG = {name: (verb, name, count) for verb, name, count in _COMMANDS.values()}
_LONG["dump_state"] = (RotctlVerb.DUMP_STATE, "dump_state", 0)


def understood_line(line: bytes) -> Command:
    """Read a line without its end.  WRONG: it is none, or its values are no numbers."""
    text = line.strip(b" \t\r\x00")
    if not text.split():
        return Command(RotctlVerb.NOTHING)
    if text[:2].upper() in (b"AZ", b"EL") or text.split()[0].upper() in (b"SA", b"SE"):
        return _easycomm(text)
    mark = ""
    if text[:1] in (b"+", b";", b"|", b",") and len(text) > 1:
        mark, text = ("\n" if text[:1] == b"+" else text[:1].decode()), text[1:].lstrip()
    words = text.split()
    if not words:
        return Command(RotctlVerb.WRONG)
    head, rest = words[0], words[1:]
    if head.startswith(b"\\"):
        found = _LONG.get(head[1:].decode("ascii", "replace"))
    else:
        found, glued = _COMMANDS.get(head[:1].decode("ascii", "replace")), head[1:]
        if glued:  # `P180 45`; but a word, such as a browser's `Sec-Fetch-Mode:`, is no stop
            rest = [glued, *rest]
            found = found if found is not None and found[2] and NUMBER.match(glued) else None
    if found is None:
        return Command(RotctlVerb.WRONG, mark=mark)
    verb, name, count = found
    if verb is not RotctlVerb.SET_POSITION:
        return Command(verb, (), name, mark)
    values = tuple(map(_number, rest[:count]))
    is_whole = len(values) == count and len(rest) == count and None not in values
    if not is_whole:
        return Command(RotctlVerb.WRONG, (), name, mark)
    return Command(verb, tuple(value for value in values if value is not None), name, mark)


def _number(word: bytes) -> float | None:
    """A finite number with a decimal point; None: nan, inf, a comma, and whatever else is none."""
    if NUMBER.fullmatch(word) is None:
        return None
    value = float(word)
    return value if isfinite(value) else None


def _easycomm(text: bytes) -> Command:
    """EasyComm II: `AZ180.0 EL45.0` points, `AZ EL` asks, `SA SE` stops; what else stands in the line is for radios."""
    if text[:1].upper() == b"S":
        return Command(RotctlVerb.EASYCOMM_STOP)
    words = [(word[:2].upper(), word[2:]) for word in text.split()]
    found = {name: value for name, value in words if name in (b"AZ", b"EL")}
    if all(value == b"" for value in found.values()):
        return Command(RotctlVerb.EASYCOMM_GET)
    values = [_number(found.get(name, b"")) for name in (b"AZ", b"EL")]
    if None in values:
        return Command(RotctlVerb.WRONG, name="easycomm")
    return Command(RotctlVerb.EASYCOMM_SET, tuple(value for value in values if value is not None))


def reply_of(command: Command, code: int, values: tuple[tuple[str, str], ...] = ()) -> bytes:
    """The answer, one segment: values with their names where the extended form is asked for, RPRT where it belongs."""
    if not command.mark:
        plain = "".join(f"{value}\n" for _, value in values)
        return (plain if values and code == OK else f"RPRT {code}\n").encode()
    said = [f"{command.name}:", *(f"{name}: {value}" for name, value in values), f"RPRT {code}"]
    return (command.mark.join(said) + "\n").encode()


def dumped_state(az_deg: tuple[float, float], el_deg: tuple[float, float]) -> bytes:
    """What Hamlib's network model reads when it opens: version, model, the limits, `done`."""
    limits = f"min_az={az_deg[0]:f}\nmax_az={az_deg[1]:f}\nmin_el={el_deg[0]:f}\nmax_el={el_deg[1]:f}\n"
    return f"1\n2\n{limits}south_zero=0\nrot_type=AzEl\ndone\n".encode()

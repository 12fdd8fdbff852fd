"""The text of a CCSDS ephemeris message, KVN or XML: its segments, still as text, with the lines they stand in."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal
from xml.parsers import expat
from xml.parsers.expat import errors

STATE_KEYS = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
_CUT = (errors.XML_ERROR_NO_ELEMENTS, errors.XML_ERROR_UNCLOSED_TOKEN, errors.XML_ERROR_PARTIAL_CHAR)


class BadSegmentError(ValueError):
    """What is wrong with a segment, or with the whole file; becomes a Problem."""

    def __init__(self, reason: str, line: int | None) -> None:
        super().__init__(reason)
        self.line = line


@dataclass(slots=True)
class RawSegment:
    """A segment as text."""

    line: int
    version: str
    created: str
    fields: dict[str, str] = field(default_factory=dict)
    states: list[tuple[int, str, list[str]]] = field(default_factory=list)  # line, epoch, six numbers
    notes: list[tuple[int, str]] = field(default_factory=list)  # line, what to know of it
    problem: BadSegmentError | None = None


@dataclass(frozen=True, slots=True)
class Layout:
    """What differs between the kinds of messages."""

    message: str  # the XML root
    version_key: str
    row: str  # the XML element that holds one epoch's values
    row_text: str  # what a line of data is, in words
    counts: tuple[int, ...]  # of values after the epoch in a line of KVN
    kept: int  # the first of these
    values: Callable[[Mapping[str, str]], list[str]]  # from the leaves of a row; KeyError: names what is missing
    is_read_cut: bool = False  # what is before the cut of a file, with a note


OEM = Layout(
    message="oem",
    version_key="CCSDS_OEM_VERS",
    row="stateVector",
    row_text="a time with position and velocity (or accelerations too)",
    counts=(6, 9),
    kept=6,
    values=lambda leaves: [leaves[key] for key in STATE_KEYS],
    is_read_cut=True,
)


def read_segments(text: str, layout: Layout = OEM) -> list[RawSegment]:
    """Read the segments, KVN or XML as the first character says.  BadSegmentError: the whole file cannot be read."""
    return _read_xml(text, layout) if text.lstrip()[:1] == "<" else _read_kvn(text, layout)


def _read_kvn(text: str, layout: Layout) -> list[RawSegment]:
    found: list[RawSegment] = []
    where: Literal["header", "meta", "data", "covariance"] = "header"
    version = created = ""
    last_line = 0
    for number, raw_line in enumerate(text.split("\n"), start=1):
        line = raw_line.strip()
        word = line.split(maxsplit=1)[0].upper() if line else "COMMENT"
        if word == "COMMENT":
            continue
        last_line = number
        if word == "META_START":
            found.append(RawSegment(number, version, created))
            where = "meta"
        elif word == "META_STOP":
            where = "data"
        elif word in ("DATA_START", "DATA_STOP"):
            continue
        elif word in ("COVARIANCE_START", "COVARIANCE_STOP"):
            where = "covariance" if word == "COVARIANCE_START" else "data"
        elif word.startswith(layout.version_key):
            where, version, created = "header", line.partition("=")[2].strip(), ""
        elif where == "header" and word.startswith("CREATION_DATE"):
            created = line.partition("=")[2].strip()
        elif where == "meta":
            _take_field(found[-1], line, number)
        elif where == "data" and found:
            _take_state(found[-1], line, number, layout)
    if layout.is_read_cut and found and where == "data":
        _drop_cut_line(found[-1], last_line, has_end=text.endswith("\n"))
    return found


def _drop_cut_line(raw: RawSegment, last_line: int, *, has_end: bool) -> None:
    """Of a file that was cut in its last line the states before it are whole.

    A line with all its numbers is cut too where the file has no last line end and the last number has lost digits.
    """
    note = (last_line, "the file ends within this line: the state is left out")
    if raw.problem is not None:
        if raw.problem.line == last_line and raw.states:
            raw.problem = None
            raw.notes.append(note)
        return
    if has_end or len(raw.states) < 2 or raw.states[-1][0] != last_line:
        return
    before, last = (len(state[2][-1].partition(".")[2]) for state in raw.states[-2:])
    if last < before:
        del raw.states[-1]
        raw.notes.append(note)


def _take_field(raw: RawSegment, line: str, number: int) -> None:
    key, equals, value = (part.strip() for part in line.partition("="))
    if equals and key:
        raw.fields[key.upper()] = value
    else:
        raw.problem = raw.problem or BadSegmentError(f"{line[:40]!r} is not KEY = VALUE", number)


def _take_state(raw: RawSegment, line: str, number: int, layout: Layout) -> None:
    epoch, *values = line.split()
    if len(values) in layout.counts:
        raw.states.append((number, epoch, values[: layout.kept]))
    else:
        reason = f"{line[:40]!r} is not {layout.row_text}"
        raw.problem = raw.problem or BadSegmentError(reason, number)


def _read_xml(text: str, layout: Layout) -> list[RawSegment]:
    """Follow the elements by expat, which knows the lines; a DOCTYPE or an entity's declaration ends it."""
    reader = _XmlReader(layout)
    try:
        reader.parser.Parse(text, True)
    except expat.ExpatError as error:
        is_cut = layout.is_read_cut and expat.ErrorString(error.code) in _CUT
        if not is_cut or not any(raw.states for raw in reader.found):
            raise BadSegmentError(f"not XML: {expat.ErrorString(error.code)}", error.lineno) from None
        reader.found[-1].notes.append((error.lineno, "the file ends here: the states before it are used"))
    except UnicodeEncodeError:
        raise BadSegmentError("not XML: characters that are none", None) from None
    return reader.found


class _XmlReader:
    """Collects metadata and the rows of every segment.  Used once."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self.found: list[RawSegment] = []
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._add_text
        self.parser.StartDoctypeDeclHandler = self._refuse
        self._within = ""  # metadata or a row
        self._line = 0
        self._text: list[str] = []
        self._leaves: dict[str, str] = {}
        self._version = ""
        self._created = ""

    def _refuse(self, *_declaration: object) -> None:
        reason = "a DOCTYPE or ENTITY declaration: such a message has none, so the file is not read"
        raise BadSegmentError(reason, self.parser.CurrentLineNumber)

    def _start(self, tag: str, attributes: Mapping[str, str]) -> None:
        name = tag.rpartition(":")[2]
        self._text = []
        if name == "segment":
            self.found.append(RawSegment(self.parser.CurrentLineNumber, self._version, self._created))
        elif name == self._layout.message:
            self._version = attributes.get("version", "").strip()
        elif name == "header":
            self._created = ""
        elif name in ("metadata", self._layout.row):
            self._within, self._leaves, self._line = name, {}, self.parser.CurrentLineNumber

    def _add_text(self, text: str) -> None:
        self._text.append(text)

    def _end(self, tag: str) -> None:
        name = tag.rpartition(":")[2]
        if name == "CREATION_DATE":
            self._created = "".join(self._text).strip()
        if name != self._within:
            self._leaves.setdefault(name, "".join(self._text).strip())
            return
        self._within = ""
        if not self.found:
            return
        raw = self.found[-1]
        if name == "metadata":
            raw.fields = self._leaves
            return
        try:
            raw.states.append((self._line, self._leaves["EPOCH"], self._layout.values(self._leaves)))
        except KeyError as missing:
            reason = f"a {self._layout.row} without {missing.args[0]}"
            raw.problem = raw.problem or BadSegmentError(reason, self._line)

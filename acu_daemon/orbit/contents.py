"""What stands in a file of elements: which format, or what else: a notice, a web page, an archive.  Pure."""

import json
import re
from typing import Any, Literal

FileKind = Literal["tle", "omm", "oem", "cpf", "sp3"]

_QUOTED = 160
_SIGNATURES = (
    *((b"\x1f\x9d", "a compress archive: unpack it with uncompress"), (b"PK\x03\x04", "a zip archive: unpack it")),
    *((b"BZh", "a bzip2 archive: unpack it with bunzip2"), (b"\xfd7zXZ", "an xz archive: unpack it with unxz")),
    *((b"\x28\xb5\x2f\xfd", "a zstd archive: unpack it with unzstd"), (b"7z\xbc\xaf", "a 7z archive: unpack it")),
    *((b"%PDF-", "a PDF document"), (b"\x89PNG", "a picture"), (b"\xff\xd8\xff", "a picture"), (b"GIF8", "a picture")),
    *((b"SQLite format", "a database"), (b"\x7fELF", "a program"), (b"{\\rtf", "an RTF document: save it as text")),
)
_UTF_16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
_TLE = re.compile(r"^[ \t\xa0]*[12][ \t\xa0][ 0-9A-Za-z][ 0-9]{3}[0-9]", re.MULTILINE)
_CPF = re.compile(r"\A(\s*00.*\n)*\s*H1\s+CPF\b", re.IGNORECASE)
_SP3 = re.compile(r"\A\s*#[a-d][PV]\d{4} ", re.IGNORECASE)
_LISTED_OMM = re.compile(
    r"\s*([\[{][\[{\s]*\"[^<]*\"(NORAD_CAT_ID|MEAN_MOTION)\"|[\w,]*,NORAD_CAT_ID\b)", re.IGNORECASE
)
_OMM = re.compile(r"CCSDS_OMM_VERS|MEAN_MOTION|<omm\b|NORAD_CAT_ID", re.IGNORECASE)
_OEM = re.compile(r"CCSDS_OEM_VERS|META_START|<oem\b|<stateVector", re.IGNORECASE)
_PAGE = re.compile(r"<!doctype\s+html|<html\b|<head>|<title\b", re.IGNORECASE)  # <body> is also of CCSDS messages
_UNSEEN = re.compile(r"<(script|style)\b.*?</\1\s*>|<!--.*?-->", re.IGNORECASE | re.DOTALL)


def binary_kind(data: bytes) -> str:
    """What a file is that is no text, by its first bytes; empty for text."""
    for signature, what in _SIGNATURES:
        if data.startswith(signature):
            return what
    is_text = data[:2] in _UTF_16 or b"\0" not in data[:1000].rstrip(b"\0\x1a")
    return "" if is_text else "no text: a binary file"


def decoded(data: bytes) -> str:
    """The text of a file, in UTF-8 or, as its byte order mark says, UTF-16; what cannot be read is marked."""
    text = data.decode(_UTF_16.get(data[:2], "utf-8"), errors="replace").replace("\ufeff", "")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def kind_of(text: str) -> FileKind | None:
    """The format by the words that only it has; None where it has none of them."""
    if _CPF.match(text):
        return "cpf"
    if _SP3.match(text):
        return "sp3"
    if _LISTED_OMM.match(text[:2000]):
        return "omm"  # by its begin: a catalogue has 8 million characters
    if _TLE.search(text):
        return "tle"
    if _PAGE.search(text[:2000]):
        return None  # one that tells of a format has its words
    if _OEM.search(text):
        return "oem"
    return "omm" if _OMM.search(text) else None


def what_else(text: str) -> str:
    """What a text without elements is, quoted."""
    start = text.lstrip()
    if not start.strip("\0\x1a \t\r\n"):
        return "the file is empty"
    if _PAGE.search(start[:2000]):
        return f"a web page, not elements: {_quoted(_without_tags(start))}"
    if start[:1] in ("{", "["):
        return _json(start)
    if start[:1] == "<":
        return f"XML, but no elements: {_quoted(_without_tags(start))}"
    return f"a notice, not elements: {_quoted(start)}"


def _json(text: str) -> str:
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        return f"JSON that cannot be read, not elements: {_quoted(text)}"
    if content in ([], {}):
        return "an empty JSON answer: no satellite fits what was asked"
    words = " ".join(_words(content))
    return f"a JSON answer, not elements: {_quoted(words or text)}"


def _words(content: Any) -> list[str]:
    if isinstance(content, dict):
        return [word for key, value in list(content.items())[:20] for word in [f"{key}:", *_words(value)]]
    if isinstance(content, list):
        return [word for value in content[:20] for word in _words(value)]
    return [str(content)]


def _without_tags(text: str) -> str:
    return re.sub(r"<[^>]*>", " ", _UNSEEN.sub(" ", text))


def _quoted(text: str) -> str:
    """In one line, shortened, in quotes."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in text[: 20 * _QUOTED]).split())
    return repr(plain if len(plain) <= _QUOTED else f"{plain[:_QUOTED]}...")

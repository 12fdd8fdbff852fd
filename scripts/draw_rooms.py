#!/usr/bin/env python3
"""Draws the rooms of the package and who imports whom, from the code: docs/pictures/rooms.svg.

Rows are the layers of pyproject.toml, upper ones import lower ones.  A dark arrow is an import that no chain of others
implies; every box names all rooms that it imports.  `control` and `assist` are shown with their floors and modules.

    scripts/draw_rooms.py                 draws this project
    scripts/draw_rooms.py ROOT OUT.svg    draws another checkout
"""

import ast
import sys
import textwrap
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from pathlib import Path

PACKAGE = "acu_daemon"
PICTURE = Path("docs/pictures/rooms.svg")
OPEN = ("control", "assist")  # shown with what is in them
UNPLACED = "in no layer"

WIDTH, MARGIN, GAP, ROW_GAP = 1200, 20, 20, 46
LINE, LETTER = 16, 7.2  # of text at 11 px, monospaced
PAD = 12
STYLE = """<style>text{font:11px monospace}text.name{font-size:14px;font-weight:bold}
.says{fill:#333}.floor{fill:#7a3b00}.imports{fill:#35618f}.room{fill:#f4f7fa;stroke:#35618f}
.arrow{fill:none;stroke:#35618f;stroke-width:1.4;marker-end:url(#tip)}</style>
<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">
<path d="M0 0L8 4L0 8z" fill="#35618f"/></marker></defs>"""

Imports = dict[str, set[str]]


@dataclass(frozen=True, slots=True)
class House:
    """Rooms by layer, top first; what each room imports and says of itself; the floors of the open ones."""

    layers: list[list[str]]
    imports: Imports
    says: dict[str, str]
    floors: dict[str, list[tuple[str, list[str]]]]


@dataclass(frozen=True, slots=True)
class Box:
    """A room on the picture, pixels from the top left."""

    x: float
    y: float
    width: float
    height: float
    lines: list[tuple[str, str]]  # class of the text, and the text


def read_house(root: Path) -> House:
    """Read the layers of ROOT/pyproject.toml and the imports of ROOT/acu_daemon."""
    modules = {_dotted(path, root): path for path in sorted((root / PACKAGE).rglob("*.py"))}
    imports: Imports = {}
    says: dict[str, str] = {}
    for name, path in modules.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        room = _room(name)
        if name == f"{PACKAGE}.{room}":
            says[room] = " ".join((ast.get_docstring(tree) or "").split("\n\n")[0].split()).removesuffix("  Pure.")
        imports.setdefault(room, set()).update(_room(one) for one in _imported(tree) if _room(one) != room)
    rooms = set(imports) - {""}
    layers = _layers(root, rooms)
    rest = sorted(rooms - {room for layer in layers for room in layer})
    return House(
        [rest, *layers] if rest else layers,
        {room: imports[room] & rooms for room in rooms},
        {room: f"({UNPLACED}) {text}" if room in rest else text for room, text in says.items()},
        {room: _floors(room, modules) for room in OPEN if room in rooms},
    )


def _dotted(path: Path, root: Path) -> str:
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _room(name: str) -> str:
    """The first part below the package; "": the package itself, or none of it."""
    parts = name.split(".")
    return parts[1] if parts[0] == PACKAGE and len(parts) > 1 else ""


def _imported(tree: ast.AST) -> Iterable[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module == PACKAGE:
            yield from (f"{PACKAGE}.{one.name}" for one in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def _layers(root: Path, rooms: set[str]) -> list[list[str]]:
    contracts = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    rows = next(one["layers"] for one in contracts if one["name"].startswith("rooms"))
    named = [row.replace(f"{PACKAGE}.", "").replace("|", " ").replace(":", " ").split() for row in rows]
    return [[room for room in row if room in rooms] for row in named]


def _floors(room: str, modules: Iterable[str]) -> list[tuple[str, list[str]]]:
    """Packages of a room with their modules, the room's own modules first."""
    inside = f"{PACKAGE}.{room}."
    packages = {name.rpartition(".")[0] for name in modules}
    floors: dict[str, list[str]] = {}
    for name in modules:
        if name.startswith(inside) and name not in packages:
            floor, _, module = name.removeprefix(inside).rpartition(".")
            floors.setdefault(floor, []).append(module)
    return sorted(floors.items())


def needed(imports: Imports) -> set[tuple[str, str]]:
    """The imports that no chain of others implies."""

    def reached(room: str, seen: set[str]) -> set[str]:
        for other in imports[room] - seen:
            seen.add(other)
            reached(other, seen)
        return seen

    below = {room: reached(room, set()) for room in imports}
    return {
        (room, other)
        for room, others in imports.items()
        for other in others
        if not any(other in below[between] for between in others - {other} if room not in below[between])
    }


def _lines(house: House, room: str, width: float) -> list[tuple[str, str]]:
    letters = int((width - 2 * PAD) / LETTER)
    lines = [("name", room)]
    lines += [("says", text) for text in textwrap.wrap(house.says.get(room, ""), letters)]
    for floor, modules in house.floors.get(room, []):
        text = f"{floor.replace('.', '/') + ': ' if floor else ''}{', '.join(modules)}"
        lines += [
            ("floor", one) for one in textwrap.wrap(text, letters, subsequent_indent="    ", break_on_hyphens=False)
        ]
    others = ", ".join(sorted(house.imports[room])) or "none of the rooms"
    lines += [("imports", text) for text in textwrap.wrap(f"imports {others}", letters, subsequent_indent="    ")]
    return lines


def _boxes(house: House) -> dict[str, Box]:
    boxes: dict[str, Box] = {}
    y = float(MARGIN)
    for layer in house.layers:
        shares = [3.0 if room in house.floors and len(layer) > 1 else 1.0 for room in layer]
        free = WIDTH - 2 * MARGIN - GAP * (len(layer) - 1)
        widths = [free * share / sum(shares) for share in shares]
        texts = [_lines(house, room, width) for room, width in zip(layer, widths, strict=True)]
        height = max(len(text) for text in texts) * LINE + 2 * PAD
        x = float(MARGIN)
        for room, width, text in zip(layer, widths, texts, strict=True):
            boxes[room] = Box(x, y, width, height, text)
            x += width + GAP
        y += height + ROW_GAP
    return boxes


def _arrow(upper: Box, lower: Box, share_out: float, share_in: float) -> str:
    """From the lower edge of one box to the upper edge of another; between neighbours in a row, from side to side."""
    if upper.y == lower.y:
        is_right = lower.x > upper.x
        y = upper.y + upper.height / 2 + (6 if is_right else -6)
        x0 = upper.x + upper.width if is_right else upper.x
        x1 = lower.x if is_right else lower.x + lower.width
        return f'<path class="arrow" d="M{x0:.0f} {y:.0f}H{x1:.0f}"/>'
    x0, y0 = upper.x + upper.width * share_out, upper.y + upper.height
    x1, y1 = lower.x + lower.width * share_in, lower.y
    bend = min(ROW_GAP, (y1 - y0)) * 0.6
    curve = f"{x0:.0f} {y0 + bend:.0f} {x1:.0f} {y1 - bend:.0f} {x1:.0f} {y1:.0f}"
    return f'<path class="arrow" d="M{x0:.0f} {y0:.0f}C{curve}"/>'


def _arrows(house: House, boxes: dict[str, Box]) -> list[str]:
    """Each at a place of its own on either box, from left to right as the other ends stand."""
    edges = needed(house.imports)

    def share(room: str, other: str, side: int) -> float:
        ends = [edge[1 - side] for edge in edges if edge[side] == room and boxes[edge[0]].y != boxes[edge[1]].y]
        ends.sort(key=lambda one: (boxes[one].x + boxes[one].width / 2, one))
        return (ends.index(other) + 1) / (len(ends) + 1) if other in ends else 0.5

    return [
        _arrow(boxes[room], boxes[other], share(room, other, 0), share(other, room, 1)) for room, other in sorted(edges)
    ]


def draw(house: House) -> str:
    """The picture, as SVG."""
    boxes = _boxes(house)
    height = max(box.y + box.height for box in boxes.values()) + MARGIN
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}">',
        STYLE,
        f'<rect width="{WIDTH}" height="{height:.0f}" fill="white"/>',
        *_arrows(house, boxes),
    ]
    for box in boxes.values():
        place = f'x="{box.x:.0f}" y="{box.y:.0f}" width="{box.width:.0f}" height="{box.height:.0f}"'
        parts.append(f'<rect class="room" {place} rx="5"/>')
        for k, (kind, text) in enumerate(box.lines):
            place = f'x="{box.x + PAD:.0f}" y="{box.y + PAD + LINE * (k + 0.75):.0f}"'
            parts.append(f'<text class="{kind}" {place} xml:space="preserve">{escape(text)}</text>')
    return "\n".join([*parts, "</svg>\n"])


def main() -> None:
    root = Path(__file__).resolve().parents[1]
    if len(sys.argv) not in (1, 3) or sys.argv[1:2] in (["-h"], ["--help"]):
        sys.exit(__doc__)
    source, out = (Path(sys.argv[1]), Path(sys.argv[2])) if len(sys.argv) == 3 else (root, root / PICTURE)
    out.write_text(draw(read_house(source)), encoding="utf-8")


if __name__ == "__main__":
    main()

"""SIMULATION: the vocabulary of faults, one for scenario files, the control port, the fake ACU and the fault proxy."""

from dataclasses import dataclass
from math import inf
from typing import Literal, get_args

from acu_daemon.sim.toml_table import read_table

LostVerb = Literal["no-reply", "late-reply", "shifted", "glued", "split", "duplicate", "latency", "jitter", "bandwidth"]
GarbledVerb = Literal["bad-checksum", "xor-blind", "swapped-digits", "truncated", "garbage-before", "garbage-after"]
WrongVerb = Literal["wrong-address", "not-hex", "out-of-range", "nak", "wrong-baud", "break"]
LineVerb = Literal["cut", "deaf", "half-open", "reset", "slow-close", "accept-then-close", "refuse", "second-client"]
PanelVerb = Literal["unplug", "power-cycle", "local-panel", "emergency-stop", "silence", "false-lock", "encoder-turn"]
EncoderVerb = Literal["frozen-encoder", "encoder-jump", "backlash", "limit-switch"]
AxisVerb = Literal["stuck", "runaway", "slow-drive", "reversed", "wind"]
VerbName = Literal[LostVerb, GarbledVerb, WrongVerb, LineVerb, PanelVerb, EncoderVerb, AxisVerb]
AxisName = Literal["azimuth", "elevation", "both"]
Direction = Literal["reply", "command"]


class FaultError(ValueError):
    """A fault that makes no sense; says what was expected."""


@dataclass(frozen=True, slots=True)
class Verb:
    """How a verb behaves.  each: acts on every frame; lasts: begins and ends; once: happens at an instant."""

    place: Literal["frame", "line", "pedestal"]
    kind: Literal["each", "lasts", "once"]
    about: str
    value: float = 0.0  # its default; 0 and no unit: it has none
    unit: str = ""
    most: float = inf


VERBS: dict[VerbName, Verb] = {
    "no-reply": Verb("frame", "each", "the frame is lost"),
    "late-reply": Verb("frame", "each", "the frame comes later, and may be overtaken", 0.15, "s"),
    "shifted": Verb("frame", "each", "each frame is kept, and goes out in the place of the next one"),
    "glued": Verb("frame", "each", "the frame is kept, and goes out in one piece with the next one"),
    "split": Verb("frame", "each", "the frame comes byte by byte, with this pause between two", 0.001, "s"),
    "duplicate": Verb("frame", "each", "the frame comes twice"),
    "bad-checksum": Verb("frame", "each", "the check byte is wrong"),
    "xor-blind": Verb("frame", "each", "two data characters change alike: the check byte still fits"),
    "swapped-digits": Verb("frame", "each", "two neighbouring characters change places: the check byte still fits"),
    "truncated": Verb("frame", "each", "the last bytes are missing", 3, "bytes", 1000),
    "garbage-before": Verb("frame", "each", "random bytes stand before the frame", 8, "bytes", 1000),
    "garbage-after": Verb("frame", "each", "random bytes stand behind the frame", 8, "bytes", 1000),
    "wrong-address": Verb("frame", "each", "the frame bears another address, and a good check byte"),
    "not-hex": Verb("frame", "each", "the azimuth reads NaN., with a good check byte"),
    "out-of-range": Verb("frame", "each", "the elevation reads 135 deg, with a good check byte"),
    "nak": Verb("frame", "each", "the command is refused and not executed (an ACU that is busy does the same)"),
    "latency": Verb("frame", "each", "frames come later, in their order", 0.03, "s"),
    "jitter": Verb("frame", "each", "frames come later by a random time up to this, in their order", 0.03, "s"),
    "bandwidth": Verb("frame", "each", "frames take their time", 960.0, "bytes/s"),
    "wrong-baud": Verb("frame", "each", "every byte of both directions is random"),
    "break": Verb("frame", "each", "a line break, which reads as one NUL, in the place of the frame"),
    "cut": Verb("line", "lasts", "nothing passes in either direction, and nobody is told (a pulled cable)"),
    "deaf": Verb("line", "lasts", "the ACU does not read: what is written waits, and then arrives all at once"),
    "half-open": Verb("line", "once", "the present connection is dead without a word; a new one works"),
    "reset": Verb("line", "once", "the present connection is reset (RST; a terminal hangs up)"),
    "slow-close": Verb("line", "lasts", "a client that leaves keeps its place for so long", 1.0, "s"),
    "accept-then-close": Verb("line", "lasts", "every new connection is closed at once"),
    "refuse": Verb("line", "lasts", "nobody listens: new connections are refused"),
    "second-client": Verb("line", "lasts", "another client takes the ACU: ours is hung up, new ones closed at once"),
    "unplug": Verb("line", "lasts", "the adapter is pulled out, and comes back under another device name"),
    "frozen-encoder": Verb("pedestal", "lasts", "the read-out stands still; the servo's own loop does not"),
    "encoder-jump": Verb("pedestal", "lasts", "the encoder slips on its shaft", 5.0, "deg"),
    "encoder-turn": Verb("pedestal", "lasts", "the azimuth reads another turn: the sector bit is wrong"),
    "power-cycle": Verb("pedestal", "lasts", "the ACU is off, then starts: registers, mode, backup, W are forgotten"),
    "local-panel": Verb("pedestal", "lasts", "a person at the panel takes control"),
    "emergency-stop": Verb("pedestal", "lasts", "the button is pressed; in the end released, the fault reset by hand"),
    "limit-switch": Verb("pedestal", "lasts", "a limit switch trips where the axis stands", 1, "(CW, up) or -1", 1.0),
    "stuck": Verb("pedestal", "lasts", "the axis does not move"),
    "runaway": Verb("pedestal", "lasts", "the axis runs at this rate while it is driven", 3.0, "deg/s"),
    "slow-drive": Verb("pedestal", "lasts", "the axis has only this share of its rate", 0.2, "of 1", 1.0),
    "reversed": Verb("pedestal", "lasts", "the axis moves the wrong way"),
    "backlash": Verb("pedestal", "lasts", "play between encoder and beam", 0.2, "deg"),
    "wind": Verb("pedestal", "lasts", "gusts push the axis, 1 sigma", 0.5, "deg/s"),
    "silence": Verb("pedestal", "lasts", "the satellite sends nothing"),
    "false-lock": Verb("pedestal", "lasts", "the receiver locks on a carrier that stands still where the beam is"),
}


FRAME_VERBS = frozenset(name for name, verb in VERBS.items() if verb.place == "frame")
PEDESTAL_VERBS = frozenset(name for name, verb in VERBS.items() if verb.place == "pedestal")


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault.  Times count from the start of the simulation, or from the command at a control port.

    each: probability for every frame, at most count of them (0: no limit), for duration_s (None: until cleared).
    lasts, once: happens count times (0: once), each with that probability; on and off for duration_s each.
    """

    verb: VerbName
    start_s: float = 0.0
    duration_s: float | None = None
    count: int = 0
    probability: float = 1.0
    value: float | None = None
    axis: AxisName = "azimuth"
    on: Direction = "reply"
    seed: int = 0

    @property
    def amount(self) -> float:
        """Its value, or the verb's default."""
        return VERBS[self.verb].value if self.value is None else self.value

    @property
    def axes(self) -> tuple[AxisName, ...]:
        return ("azimuth", "elevation") if self.axis == "both" else (self.axis,)


def read_fault(table: object, name: str = "fault") -> Fault:
    """Make a fault of a TOML table.  FaultError: names the key, its value, and what was expected."""
    try:
        fault = read_table(Fault, table, name)
    except ValueError as error:
        raise FaultError(str(error)) from None
    verb = VERBS[fault.verb]
    for is_wrong, problem in (
        (not 0.0 <= fault.probability <= 1.0, f"probability = {fault.probability:g}, expected 0 to 1"),
        (fault.count < 0, f"count = {fault.count}, expected 0 or more"),
        (fault.duration_s == 0.0, "duration_s = 0, expected more; leave it out for a fault that lasts until cleared"),
        (fault.value is not None and not verb.unit, f"{fault.verb} takes no value"),
        (fault.value is not None and abs(fault.value) > verb.most, f"value is more than {verb.most:g} {verb.unit}"),
        (fault.amount < 0 and verb.place != "pedestal", f"value = {fault.amount:g}, expected 0 or more"),
        (fault.verb == "bandwidth" and fault.amount == 0.0, "value = 0, expected more"),
        (fault.on == "command" and verb.place != "frame", f"{fault.verb} acts on no frame: leave out on"),
        (fault.count > 1 and verb.kind == "lasts" and fault.duration_s is None, "count needs duration_s here"),
    ):
        if is_wrong:
            raise FaultError(f"[{name}] {problem}")
    return fault


def parse_fault(text: str) -> Fault:
    """Make a fault of a line such as `no-reply count=3 probability=0.5`.  FaultError: says what is wrong."""
    verb, *pairs = text.split()
    table: dict[str, object] = {"verb": verb}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals:
            raise FaultError(f"{pair!r}: expected KEY=VALUE, such as count=3")
        table[key] = _number_or_text(value)
    return read_fault(table)


def fault_text(fault: Fault) -> str:
    """A fault as such a line; what is left at its default is left out."""
    plain = Fault(fault.verb)
    keys = ("start_s", "duration_s", "count", "probability", "value", "axis", "on", "seed")
    given = [(key, getattr(fault, key)) for key in keys if getattr(fault, key) != getattr(plain, key)]
    words = (f"{key}={value:g}" if isinstance(value, float) else f"{key}={value}" for key, value in given)
    return " ".join((fault.verb, *words))


def vocabulary() -> str:
    """Every verb with what it does, for people."""
    width = max(map(len, get_args(VerbName)))
    lines = []
    for name, verb in VERBS.items():
        value = f"; value={verb.value:g} {verb.unit}" if verb.unit else ""
        lines.append(f"{name:{width}}  {verb.about}{value}")
    return "\n".join(lines)


def _number_or_text(text: str) -> object:
    try:
        return int(text)
    except ValueError:
        try:
            return float(text)
        except ValueError:
            return text

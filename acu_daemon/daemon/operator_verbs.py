"""What a person may say to the running daemon, whoever hands it on: command line, page, another program's port.

A line is `VERB [KEY=VALUE ...]`.  It is read and its figures are held to their bounds here, once.  Pure.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite

from acu_daemon.errors import UsageError


@dataclass(frozen=True, slots=True)
class VerbParameter:
    """A figure with its unit and bounds, or, without a unit, a text."""

    name: str
    what: str
    unit: str = ""
    least: float = 0.0
    most: float = 0.0


@dataclass(frozen=True, slots=True)
class OperatorVerb:
    """is_of_station: only a station has it, `run` without --satellite."""

    name: str
    what: str
    parameters: tuple[VerbParameter, ...] = ()
    is_of_station: bool = False


PASS = (VerbParameter("satellite", "name of its file"), VerbParameter("at", "a UTC at which it is up"))
VERBS: Mapping[str, OperatorVerb] = {
    verb.name: verb
    for verb in (
        OperatorVerb("arm", "let the daemon move the antenna"),
        OperatorVerb("disarm", "STOP if the daemon moves the antenna, then nothing but polls"),
        OperatorVerb("stop", "STOP to the ACU at once, whoever moves the antenna, then nothing but polls until `arm`"),
        OperatorVerb("clear", "clear the latch of an axis"),
        OperatorVerb("stow", "send the antenna to its stow position, and keep it there until `unstow`"),
        OperatorVerb("unstow", "end a stow, whoever's it is; the antenna leaves it when a pass is near"),
        OperatorVerb("hold", "leave autotrack and follow the prediction, to the end of the pass or until `track`"),
        OperatorVerb("track", "end a `hold`: autotrack is selected again on the path"),
        OperatorVerb(
            "nudge",
            "move the path that the antenna is led along, to the end of the pass or the next fit; both 0 undo it",
            (
                VerbParameter("along_s", "late, or early where negative; left out: as it is", "s", -60.0, 60.0),
                VerbParameter("across_deg", "right of the motion; left out: as it is", "deg", -5.0, 5.0),
                VerbParameter("keep", "yes: the satellite's next passes begin with it, while these elements hold"),
            ),
        ),
        OperatorVerb(
            "skip", "give up a pass: that one, else that in progress, else the next", PASS, is_of_station=True
        ),
        OperatorVerb("unskip", "withdraw a word about a pass", PASS, is_of_station=True),
        OperatorVerb(
            "pause",
            "begin no pass until then; the pause ends by itself",
            (VerbParameter("until", "UTC, ISO 8601 with Z"),),
            is_of_station=True,
        ),
        OperatorVerb("unpause", "end a pause now", is_of_station=True),
        OperatorVerb(
            "grant",
            "give the write lease to a program at the rotctld port, which then leads the antenna",
            (
                VerbParameter("to", "the program's IP address"),
                VerbParameter("lasts_s", "so long after its last command", "s", 5.0, 3600.0),
                VerbParameter("name", "what it is, for people"),
                VerbParameter("over", "yes: take the lease over from who has it"),
            ),
        ),
        OperatorVerb("revoke", "take the write lease back from whoever has it"),
        OperatorVerb("reload", "read files and elements again, between passes", is_of_station=True),
    )
}


@dataclass(frozen=True, slots=True)
class Said:
    """A line as it was understood.  figures, texts: what was given, by the names of the verb's parameters."""

    line: str
    verb: OperatorVerb
    figures: Mapping[str, float] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)


def understood(line: str) -> Said:
    """Read a line.  UsageError: it is none of VERBS, or a figure is not within its bounds; says what is expected."""
    name, *given = line.split(" ")
    verb = VERBS.get(name)
    if verb is None:
        raise UsageError(f"{line!r} is unknown, expected status, {', '.join(VERBS)}")
    parameters = {one.name: one for one in verb.parameters}
    figures, texts = {}, {}
    for word in given:
        key, _, value = word.partition("=")
        parameter = parameters.get(key)
        if parameter is None or not value:
            expected = ", ".join(f"{one}=" for one in parameters) or "nothing behind it"
            raise UsageError(f"{line!r}: {word!r} is unknown, expected {expected}")
        if parameter.unit:
            figures[key] = _figure(parameter, value)
        else:
            texts[key] = value
    return Said(line, verb, figures, texts)


def _figure(parameter: VerbParameter, value: str) -> float:
    try:
        figure = float(value)
    except ValueError:
        figure = float("nan")
    if not isfinite(figure) or not parameter.least <= figure <= parameter.most:
        bounds = f"{parameter.least:g} to {parameter.most:g} {parameter.unit}"
        raise UsageError(f"{parameter.name}={value}: expected {bounds}")
    return figure

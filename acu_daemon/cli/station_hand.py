"""A person's hand on the running station: the verbs that are the station's, and what of the others it has a say in."""

from collections.abc import Callable

from acu_daemon.cli.options import parse_utc
from acu_daemon.cli.station_day import StationDay
from acu_daemon.config.load import satellite_names
from acu_daemon.daemon.operator_requests import STATUS, tell
from acu_daemon.daemon.operator_verbs import Said, understood
from acu_daemon.daemon.service import Service
from acu_daemon.edge.schedule_file import NO_PAUSE
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.rules import PassRequest, Wish


class StationHand:
    """Answers at once; what it writes goes out beside the loop.  elements: of the pass that is on."""

    def __init__(self, day: StationDay, now_tai_s: Callable[[], float]) -> None:
        self._day, self._now_tai_s = day, now_tai_s

    def answer(self, line: str, who: str, service: Service | None) -> str:
        """`ok ...` or `error ...`.  who: says it, and from where.  service: the run that is on."""
        if service is None:
            return "error the station starts"
        if line == STATUS:
            return service.answer(line, who)
        try:
            said = understood(line)
            answer = self._own(said, who, service)
        except UsageError as error:
            return f"error {error}"
        return service.answer(line, who) if answer is None else tell(line=line, who=who, answer=answer)

    def _own(self, said: Said, who: str, service: Service) -> str | None:
        """None: the run answers.  Raises: UsageError."""
        match said.verb.name:
            case "reload":
                return self._day.ask_reload()
            case "unstow":
                why = self._day.why_not_unstow()
                return f"error {why}" if why else None
            case "pause":
                return self._pause(said, who)
            case "unpause":
                self._day.keeper.pause(NO_PAUSE, who)
                return "ok the pause is over"
            case "skip":
                return self._skip(said, who, service)
            case "unskip":
                request = self._request(said, Wish.NONE)
                self._day.keeper.say(request, who)
                return f"ok the pass of {request.satellite} is as planned"
            case "nudge" if "keep" in said.texts:
                return self._nudge(said, who, service)
        return None

    def _pause(self, said: Said, who: str) -> str:
        until_tai_s = parse_utc("until", said.texts.get("until", ""))
        if until_tai_s <= self._now_tai_s():
            return f"error until={said.texts['until']}: expected a time to come; it is {utc_text(self._now_tai_s(), 0)}"
        self._day.keeper.pause(until_tai_s, who)
        return f"ok no pass is begun until {utc_text(until_tai_s, 0)}"

    def _skip(self, said: Said, who: str, service: Service) -> str:
        request = self._request(said, Wish.EXCLUDE) if said.texts else None
        on = self._day.course.entry
        if on is not None and (
            request is None or request.is_of(on.satellite, on.rise_tai_s, on.culmination_tai_s, on.set_tai_s)
        ):
            self._day.course.cancel(who)
            service.stop(f"skipped by {who or 'a person'}")
            return f"ok given up: {on.name}"
        if request is None:
            entry = self._day.keeper.coming()
            if entry is None:
                return "error skip: no pass is granted"
            request = PassRequest(entry.satellite, entry.culmination_tai_s, Wish.EXCLUDE)
        self._day.keeper.say(request, who)
        return f"ok not tracked: {request.satellite} at {utc_text(request.at_tai_s, 0)}; `unskip` withdraws it"

    def _request(self, said: Said, wish: Wish) -> PassRequest:
        """Raises: UsageError."""
        name, names = said.texts.get("satellite", ""), satellite_names(self._day.config)
        if name not in names:
            raise UsageError(f"satellite={name}: no such satellite, there are {', '.join(names)}")
        return PassRequest(name, parse_utc("at", said.texts.get("at", "")), wish)

    def _nudge(self, said: Said, who: str, service: Service) -> str:
        entry = self._day.course.entry
        if said.texts["keep"] != "yes":
            return f"error keep={said.texts['keep']}: expected yes, or nothing"
        if entry is None:
            return "error no pass is on"
        answer = service.answer(" ".join(word for word in said.line.split() if not word.startswith("keep=")), who)
        if answer.startswith("ok"):
            self._day.course.keep_nudge()
        return answer

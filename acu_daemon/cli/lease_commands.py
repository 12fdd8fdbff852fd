"""`acu-daemon grant` and `revoke`: who beside the daemon may lead the antenna."""

from typing import Annotated

import typer

from acu_daemon.cli.operator_commands import Config, Rehearsal, State, say


def grant(
    address: Annotated[str, typer.Argument(metavar="ADDRESS", help="IP address of the program.")],
    config: Config = None,
    state: State = None,
    rehearsal: Rehearsal = False,
    lasts_s: Annotated[
        float, typer.Option("--lasts-s", metavar="S", help="It ends so long after its last command: 5 to 3600.")
    ] = 120.0,
    name: Annotated[str, typer.Option("--name", metavar="WORD", help="What it is, for people.")] = "",
    over: Annotated[bool, typer.Option("--over", help="Take it over from who has it.")] = False,
) -> None:
    """Give the write lease to a program at the rotctld port ([rotctld] listen): it then leads the antenna.

    What it says goes through limits and keep-outs as all commands do.  A pass that is on, or comes meanwhile, is given
    up for as long.  `acu-daemon revoke` takes it back; it ends by itself when the program is silent.

    Exit status: 0; 1 somebody else has it, no such port, no daemon or no permission.
    """
    words = ["grant", f"to={address}", f"lasts_s={lasts_s:g}"]
    words += [f"name={name.replace(' ', '-')}"] if name else []
    words += ["over=yes"] if over else []
    say(" ".join(words), config, state, is_rehearsal=rehearsal)


def revoke(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Take the write lease back, whoever has it: the antenna stands, and the daemon goes on with its passes.

    Exit status: 0; 1 no daemon or no permission.
    """
    say("revoke", config, state, is_rehearsal=rehearsal)

"""`python -m acu_daemon`, and the command `acu-daemon`."""

import gc
import os
import sys


def main() -> None:
    """Run the command line.  A Ctrl-C ends it without a traceback from the first moment on."""
    try:
        if "--events" in sys.argv:  # the daemon's own fetcher: before it loads anything, the ticks go first
            os.nice(19)
        gc.disable()  # what is loaded is no garbage, and looking for some takes a fifth of the start
        keep_out_the_working_directory()  # before anything more is loaded: it might be found there
        from acu_daemon.edge.denied import denied
        from acu_daemon.edge.signals import guard_the_start

        guard_the_start()
        sys.modules.setdefault("rich", None)  # type: ignore[arg-type]  # structlog would load it for colours nobody here prints
        from acu_daemon.cli import main as command_line

        command_line()
    except KeyboardInterrupt:
        sys.exit(130)
    except (ImportError, MemoryError, OSError) as error:  # while it is loaded; the command line tells all else itself
        print(f"acu-daemon: the system denies what this needs: {denied(error)}", file=sys.stderr)  # noqa: T201
        sys.exit(2)


def keep_out_the_working_directory() -> None:
    """Load nothing from the directories of the shell and of the script: a file there may have any library's name.

    Python puts one of them first unless it runs with -P, and takes an empty part of $PYTHONPATH for the first.
    """
    try:
        here = os.getcwd()  # noqa: PTH109  pathlib is slow to load
    except OSError:  # removed meanwhile
        here = ""
    if not sys.flags.safe_path and sys.path and sys.path[0] in ("", here, _directory(os.path.realpath(sys.argv[0]))):
        del sys.path[0]
    if "" in os.environ.get("PYTHONPATH", "none").split(os.pathsep) and here in sys.path:
        sys.path.remove(here)
    home = _directory(_directory(os.path.realpath(__file__)))
    if home not in sys.path:
        sys.path.append(home)  # not installed, but started in it: last, where nothing in it hides a library


def _directory(path: str) -> str:
    return os.path.dirname(path)  # noqa: PTH120


if __name__ == "__main__":
    main()

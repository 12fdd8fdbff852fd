"""`python -m acu_daemon`, and the command `acu-daemon`."""

import gc
import sys
from types import ModuleType
from typing import cast


def main() -> None:
    """Run the command line.  A Ctrl-C ends it without a traceback from the first moment on."""
    try:
        gc.disable()  # what is loaded is no garbage, and looking for some takes a fifth of the start
        sys.modules.setdefault("rich", cast(ModuleType, None))  # structlog would load it for colours nobody here prints
        from acu_daemon.cli import main as command_line

        command_line()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()

"""Rich is kept out of a start that is in a hurry (`acu_daemon.__main__`); what draws with it calls this first."""

import sys


def let_rich_load() -> None:
    """From here on `import rich` finds it."""
    if sys.modules.get("rich", sys) is None:
        del sys.modules["rich"]

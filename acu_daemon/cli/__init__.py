"""The commands, and the composition root: the only room that chooses real or simulated (design sections 2 and 8)."""

from acu_daemon.cli.app import main

__all__ = ["main"]

"""The commands, and the composition root: the only room that chooses real or simulated."""

from acu_daemon.cli.app import main

__all__ = ["main"]

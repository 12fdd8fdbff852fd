"""The running daemon: foreground, background, common area."""

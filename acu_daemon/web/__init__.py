"""The operator's page: one page of a running daemon, live, with the hands to stop and to steer it (docs/page.md)."""

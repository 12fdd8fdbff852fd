"""The words in which the daemon and an ACU's driver speak: commands, replies, what an ACU can do.  Pure."""

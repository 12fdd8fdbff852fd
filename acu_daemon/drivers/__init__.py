"""The ACUs that the daemon can drive, a room for each: how field words become bytes and back.  Pure."""

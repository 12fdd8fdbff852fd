"""The decision of every tick: its memory, what it is given, what it orders; floors: safety and tracking.  Pure."""

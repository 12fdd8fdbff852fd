"""The decision of every tick: state machine, lag, safety gate.  Pure."""

"""SIMULATION: the fake ACU with pedestal, receiver and sky.  Never imported by the daemon."""

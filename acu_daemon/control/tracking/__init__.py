"""What is done in a pass: the table of states, where the registers point, what is learned of signal and lag."""

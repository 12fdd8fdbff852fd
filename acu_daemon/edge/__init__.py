"""Where the program touches the world: links, clock, fit process, files, logs."""

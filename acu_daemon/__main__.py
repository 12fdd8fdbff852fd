"""`python -m acu_daemon`: the same as the command `acu-daemon`."""

from acu_daemon.cli import main

if __name__ == "__main__":
    main()

"""The command `retouch`, and `python -m retouch`: heeds signals first, then loads the verbs."""

import sys

from optimize.runs.interrupts import INTERRUPTED, interruptible, leave_interrupted, leave_on_signal


def main() -> int:
    """Run the command; see `retouch.commands.main.main`."""
    status = INTERRUPTED
    try:
        with interruptible(leave=leave_interrupted):
            from retouch.commands.main import main as command

            status = command()
    except KeyboardInterrupt:
        leave_interrupted()
    finally:
        leave_on_signal(status)
    return status


if __name__ == "__main__":
    sys.exit(main())

"""The command `retouch`, and `python -m retouch`: heeds signals first, then loads the verbs."""

import gc
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
        # The interpreter would search all that was imported for cycles, for half a second, before it ends.
        gc.freeze()
    return status


if __name__ == "__main__":
    sys.exit(main())

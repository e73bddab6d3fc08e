"""`python -m retouch` is the command `retouch`."""

import sys

from retouch.commands.main import main

if __name__ == "__main__":
    sys.exit(main())

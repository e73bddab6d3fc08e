"""`python -m optimize` is the command `retouch`."""

import sys

from optimize.cli import main

sys.exit(main())

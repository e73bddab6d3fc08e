"""`python -m optimize` is the command `retouch`."""

import sys

from optimize.commands.main import main

sys.exit(main())

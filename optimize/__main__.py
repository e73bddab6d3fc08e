"""The command `retouch` as a module: `python -m optimize`."""

import sys

from optimize.commands.main import main

sys.exit(main())

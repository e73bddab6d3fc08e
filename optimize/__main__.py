"""`python -m optimize` is the command `retouch`."""

import runpy

if __name__ == "__main__":
    runpy.run_module("retouch", run_name="__main__")

"""Run time against error. Threads wait as under the command line: spinning ones slow each other down."""

import os

from retouch.commands.main import PATIENT_THREADS

# Before torch, which reads them once.
for _name, _value in PATIENT_THREADS.items():
    os.environ.setdefault(_name, _value)

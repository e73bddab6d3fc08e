"""Studies: tables of runs that one file describes."""

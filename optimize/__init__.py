"""Touch and sight in one optimisation; the command line. The names below load what they need on first use."""

from typing import Any

_WHERE = {"run": "optimize.runs.job", "resume": "optimize.runs.job", "Result": "optimize.runs.job"}
__all__ = ["Result", "resume", "run"]


def __getattr__(name: str) -> Any:
    if name in _WHERE:
        from importlib import import_module

        return getattr(import_module(_WHERE[name]), name)
    raise AttributeError(f"module 'optimize' has no attribute {name!r}")

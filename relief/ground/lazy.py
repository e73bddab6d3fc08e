"""Names of a package that are imported on first use, so that importing the package costs nothing."""

import ast
import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from pkgutil import resolve_name
from types import ModuleType
from typing import Any


class LoadedAtFirstUse:
    """A module that is imported as soon as one of its attributes is asked for.

    Under ``if TYPE_CHECKING`` the module is imported by the same name, so that type checkers know its names.

    Args:
        load: imports the module.
    """

    def __init__(self, load: Callable[[], ModuleType]) -> None:
        self._load = load

    @cached_property
    def _module(self) -> ModuleType:
        return self._load()

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._module, attribute)


@contextmanager
def _no_collection() -> Iterator[None]:
    """Pause the collection of cycles, which would search what imports make, and what stays, many times.

    At the end all objects are put into the oldest generation, as if they had been searched.
    """
    collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collected:
            # An application may have frozen objects of its own, which stay so.
            if not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()
            gc.enable()


def lazy_names(
    package: ModuleType, finish: str = ""
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package (PEP 562).

    The package imports its public names under ``if TYPE_CHECKING``, for type checkers, each `as` itself.
    These statements are read here, so that a name and where the name comes from are written once. A public
    name must not be that of a module of the package: importing the module would hide the name.

    Args:
        package: to which the names are added as they are used.
        finish: function, as `module:name`, that gives what stands under a name in place of what its source
            holds; loaded when the first name is used.
    """
    statements = ast.walk(ast.parse(Path(str(package.__file__)).read_text(encoding="utf-8")))
    sources = {
        alias.name: f"{node.module}:{alias.name}"
        for node in statements
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    }
    public = sorted(sources)

    def getattribute(name: str) -> Any:
        if name not in sources:
            raise AttributeError(f"module {package.__name__!r} has no attribute {name!r}")
        with _no_collection():
            value = resolve_name(sources[name])
            if finish:
                value = resolve_name(finish)(value)
        setattr(package, name, value)
        return value

    return getattribute, lambda: list(public), public

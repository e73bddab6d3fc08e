"""Names of a package that are imported on first use, so that importing the package costs nothing."""

from collections.abc import Callable, Mapping
from pkgutil import resolve_name
from types import ModuleType
from typing import Any


def lazy_names(
    package: ModuleType, sources: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The functions `__getattr__` and `__dir__` of a package (PEP 562).

    A public name must not be that of a module of the package: importing the module would hide the name.

    Args:
        package: to which the names are added as they are used.
        sources: for each public name the module that defines it.
    """

    def getattribute(name: str) -> Any:
        if name not in sources:
            raise AttributeError(f"module {package.__name__!r} has no attribute {name!r}")
        value = resolve_name(f"{sources[name]}:{name}")
        setattr(package, name, value)
        return value

    return getattribute, lambda: sorted({*vars(package), *sources})

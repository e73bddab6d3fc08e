"""Packages whose names load on first use offer the same names as if they had loaded at once."""

import pkgutil

import pytest

import optimize
import tactile


@pytest.mark.parametrize("package", [optimize, tactile])
def test_every_public_name_is_there_and_completes(package) -> None:
    for name in package.__all__:
        assert getattr(package, name).__name__ == name
        assert name in dir(package)


@pytest.mark.parametrize("package", [optimize, tactile])
def test_no_module_has_a_public_name(package) -> None:
    """Its import would put the module in the place of the function or class."""
    modules = {module.name for module in pkgutil.iter_modules(package.__path__)}
    assert modules & set(package.__all__) == set()


def test_other_names_are_refused() -> None:
    with pytest.raises(AttributeError, match="'tactile' has no attribute 'pres'"):
        tactile.pres  # noqa: B018

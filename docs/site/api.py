"""The reference of the Python packages, written from signatures and docstrings without importing the code.

The packages need gigabytes, which no page needs. The lists of keywords alone are imported, as they load
nothing.
"""

import ast
import copy
import importlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from sphinx.ext.napoleon import Config, GoogleDocstring

from relief.ground.options import declared, in_python

ROOT = Path(__file__).parents[2]
PACKAGES = ("retouch", "tactile", "visual", "optimize")
"""Packages whose public names have a reference; a name of several is described under the first."""
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Definition:
    """A public name, the module of its definition and the definition."""

    name: str
    module: str
    node: Function | ast.ClassDef


@cache
def _tree(module: str) -> ast.Module:
    path = ROOT / module.replace(".", "/")
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return ast.parse(file.read_text(encoding="utf-8"))


def _imports(module: str) -> Iterator[tuple[str, str, str]]:
    """Names that a module imports from the repository: as what, from where, and the name there."""
    for node in ast.walk(_tree(module)):
        if isinstance(node, ast.ImportFrom) and (ROOT / str(node.module).partition(".")[0]).is_dir():
            yield from ((alias.asname or alias.name, node.module, alias.name) for alias in node.names)


def public(package: str) -> dict[str, Definition]:
    """What a package offers by name: functions first, then classes, each in alphabetical order."""
    found = {}
    for name, module, original in _imports(package):
        for node in _tree(module).body:
            if isinstance(node, Function | ast.ClassDef) and node.name == original != "lazy_names":
                found[name] = Definition(name, module, node)
    return dict(sorted(found.items(), key=lambda one: (isinstance(one[1].node, ast.ClassDef), one[0])))


def reference_of(package: str) -> str:
    """Markdown of a package: a table of all names, and the description of those not described before."""
    names = public(package)
    before = {name for other in PACKAGES[: PACKAGES.index(package)] for name in public(other)}
    lines = [".. list-table::", "   :widths: auto", ""]
    for name, one in names.items():
        home = next(other for other in PACKAGES if name in public(other))
        role = "func" if isinstance(one.node, Function) else "class"
        lines += [
            f"   * - :py:{role}:`{package}.{name} <{home}.{name}>`",
            f"     - {_first_sentence(one.node)}",
        ]
    lines += ["", f".. py:currentmodule:: {package}", ""]
    for name, one in names.items():
        if name not in before:
            lines += _described(one)
    return "\n".join(["~~~~~~{eval-rst}", *lines, "~~~~~~"])


def _first_sentence(node: Function | ast.ClassDef) -> str:
    text = " ".join((ast.get_docstring(node) or "").split("\n\n")[0].split())
    return _escaped(re.split(r"(?<=\.) ", text)[0])


def _described(one: Definition) -> Iterator[str]:
    """Lines of reStructuredText of a function, or of a class with its methods."""
    node, module = one.node, one.module
    if isinstance(node, Function):
        yield from _entry("function", f"{one.name}{_signature(node, module)}", _documentation(node, module))
        return
    kind = (
        "exception"
        if any(isinstance(base, ast.Name) and base.id.endswith("Error") for base in node.bases)
        else "class"
    )
    yield from _entry(kind, f"{one.name}{_construction(node, module)}", _documentation(node, module))
    for member in node.body:
        if isinstance(member, Function) and not member.name.startswith("_") and ast.get_docstring(member):
            decorators = {ast.unparse(decorator) for decorator in member.decorator_list}
            if decorators & {"property", "cached_property"}:
                options = [f":type: {ast.unparse(member.returns)}"] if member.returns else []
                lines = _entry("property", member.name, _documentation(member, module), options)
            else:
                options = [f":{name}:" for name in ("classmethod", "staticmethod") if name in decorators]
                signature = _signature(member, module, "staticmethod" not in decorators)
                lines = _entry("method", f"{member.name}{signature}", _documentation(member, module), options)
            yield from (f"   {line}".rstrip() for line in lines)


def _entry(kind: str, signature: str, text: list[str], options: list[str] | None = None) -> list[str]:
    return [
        f".. py:{kind}:: {signature}",
        *(f"   {line}".rstrip() for line in [*(options or []), "", *text]),
        "",
    ]


def _documentation(node: Function | ast.ClassDef, module: str) -> list[str]:
    """A docstring as reStructuredText, with the keywords that `by_keywords` adds."""
    text = ast.get_docstring(node) or ""
    if options := _keywords(node, module):
        lines = (f"    {name}: {in_python(one)}." for name, one in declared(options).items())
        text += "\n\nKeyword Args:\n" + "\n".join(lines)
    config = Config(napoleon_use_ivar=True, napoleon_use_rtype=False)
    kind = "class" if isinstance(node, ast.ClassDef) else "function"
    # Errors that go on over several lines are one line with breaks.
    return [
        _escaped(re.sub(r"\s*\n\s*", " ", line)) for line in GoogleDocstring(text, config, what=kind).lines()
    ]


def _escaped(text: str) -> str:
    """A text whose bars, which mean something in reStructuredText outside of literals, are shown."""
    return re.sub(r"(`[^`]*`)|\|", lambda found: found[1] or "\\|", text)


def _keywords(node: Function | ast.ClassDef, module: str) -> type | None:
    """The dataclass of keywords that a function takes."""
    for decorator in node.decorator_list:
        found = re.fullmatch(r"by_keywords\((\w+)\)", ast.unparse(decorator))
        if found:
            home = next(source for name, source, _ in _imports(module) if name == found[1])
            options: type = getattr(importlib.import_module(home), found[1])
            return options
    return None


def _signature(node: Function, module: str, bound: bool = False) -> str:
    """Parameters and result, with the values of constants that are defaults."""
    arguments = copy.deepcopy(node.args)
    if bound:
        arguments.args = [argument for argument in arguments.args if argument.arg not in ("self", "cls")]
    if _keywords(node, module):
        arguments.args = [argument for argument in arguments.args if argument.arg != "options"]
        arguments.kwarg = ast.arg("keywords")
    _with_values(arguments.defaults, module)
    _with_values(arguments.kw_defaults, module)
    return f"({ast.unparse(arguments)})" + (f" -> {ast.unparse(node.returns)}" if node.returns else "")


def _with_values(defaults: list[ast.expr] | list[ast.expr | None], module: str) -> None:
    for at, default in enumerate(defaults):
        if isinstance(default, ast.Name):
            defaults[at] = _value(default, module)


def _value(name: ast.Name, module: str) -> ast.expr:
    """What a constant of a module is, where it is a number or a text."""
    for node in _tree(module).body:
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        value = getattr(node, "value", None)
        if isinstance(target, ast.Name) and target.id == name.id and isinstance(value, ast.Constant):
            return value
    for known, source, original in _imports(module):
        if known == name.id:
            return _value(ast.Name(original), source)
    return name


def _construction(node: ast.ClassDef, module: str) -> str:
    """How an object is made: the fields of a dataclass, or the parameters of `__init__`."""
    for member in node.body:
        if isinstance(member, Function) and member.name == "__init__":
            return _signature(member, module, bound=True).removesuffix(" -> None")
    if not any(ast.unparse(decorator).startswith("dataclass") for decorator in node.decorator_list):
        return ""
    fields = []
    for member in node.body:
        if isinstance(member, ast.AnnAssign):
            default = _value(member.value, module) if isinstance(member.value, ast.Name) else member.value
            fields.append(
                ast.unparse(member.target)
                + f": {ast.unparse(member.annotation)}"
                + (f" = {ast.unparse(default)}" if default else "")
            )
    return f"({', '.join(fields)})"

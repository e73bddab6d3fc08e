"""Options of verbs, each declared once: a field of a frozen dataclass, `Annotated` with its `Option`.

`add_options` makes the fields options of the command line and `given` reads them back; `by_keywords` makes
them keywords of a Python function; `checked` refuses values out of range; `words` writes a command line and
`overrides` keys of a run file. The app's fields take label, range and help from the same place.

The dataclasses stand in modules that import nothing heavy, because `--help` imports them all. What no field
can state (a check of several options, a file that is read) stays with the verb; what no row of argparse can
(positional arguments, `-D`) stays plain argparse.
"""

import argparse
import functools
import inspect
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, Generic, ParamSpec, TypeVar, get_args, overload

from relief.ground.errors import InputError
from relief.ground.formatting import plain

if TYPE_CHECKING:
    from relief.ground.progress import Progress

LONGEST_NUMBER = 40
"""Most characters of a whole number."""
A = TypeVar("A")
B = TypeVar("B")
C = TypeVar("C")
Kind = TypeVar("Kind")
Result = TypeVar("Result")
Keywords = ParamSpec("Keywords")


@dataclass(frozen=True)
class Option:
    """How a field of a dataclass is an option.

    Attributes:
        help: what the option does, without its default.
        usage: placeholder of the value in the help, such as "MM"; with another flag than the field's name
            gives, "--turn DEGREES". Empty: as argparse makes it.
        range: least and greatest number, both allowed; None: any.
        choices: the only values, in order.
        alone: value of an option that is given without one; "": the option needs a value.
        default: what holds where the option is not given, in words; None: the field's default, "" for none.
        python: the help of the keyword, where a keyword takes other values than the command; "": `help`.
        read: from the text on the command line to the value; None: by the field's type.
        several: whether the option may be given several times.
        exclusive: name of a set of options of which one at most may be given.
        key: dotted key of the run file that the option sets.
        label: name of the field on the app's page; empty: the page has none.
        offered: values that the field offers; empty: any text or number.
    """

    help: str
    usage: str = ""
    range: tuple[float, float] | None = None
    choices: tuple[str | int, ...] = ()
    alone: str = ""
    default: str | None = None
    python: str = ""
    read: Callable[[str], object] | None = None
    several: bool = False
    exclusive: str = ""
    key: str = ""
    label: str = ""
    offered: tuple[str, ...] = ()


@dataclass(frozen=True)
class Declared:
    """A field that is an option.

    Attributes:
        name: of the field, the argument and the keyword.
        type: of a value that is given.
        value: where nothing is given.
        option: how the field is an option.
        group: heading in the help; "" for none.
    """

    name: str
    type: type
    value: Any
    option: Option
    group: str

    @property
    def flag(self) -> str:
        """The option on the command line."""
        flag = self.option.usage.partition(" ")[0]
        return flag if flag.startswith("--") else f"--{self.name.replace('_', '-')}"

    @property
    def unit(self) -> str | None:
        """Placeholder of the value in the help."""
        return self.option.usage.removeprefix(self.flag).strip() or None

    def check(self, value: Any) -> None:
        """Raise InputError, which begins with the name, if a value is out of range or no choice."""
        option = self.option
        if option.choices and value not in option.choices:
            fault = f"{plain(str(value)[:160])!r} is not one of {', '.join(map(str, option.choices))}"
            raise InputError(f"{self.name}: {fault}")
        low, high = option.range or (-math.inf, math.inf)
        if option.range and not low <= value <= high:
            raise InputError(f"{self.name}: {value:g} is outside [{low:g}, {high:g}]")


def declared(options: type) -> dict[str, Declared]:
    """Fields of a dataclass that are options, by name; those of the first base come first.

    A base is a group of the help: its attribute `GROUP`, if it has one, is the heading.
    """
    by_name = {field.name: field for field in fields(options)}
    return {
        name: _declared(by_name[name], getattr(base, "GROUP", ""))
        for base in (*(base for base in options.__mro__[1:] if base is not object), options)
        for name, annotation in inspect.get_annotations(base).items()
        if hasattr(annotation, "__metadata__")
    }


def _declared(field: "Field[Any]", group: str) -> Declared:
    annotation: Any = field.type
    (option,) = annotation.__metadata__
    known = (bool, int, float, str, Path)
    value_type = annotation.__origin__
    types = [one for one in (value_type, *get_args(value_type)) if one in known]
    value = None if field.default is MISSING else field.default
    return Declared(field.name, types[0] if types else str, value, option, group)


def add_options(parser: argparse.ArgumentParser, options: type) -> dict[str, Any]:
    """Add the options of a dataclass to a parser, None where not given.

    Returns:
        The groups of the help by their headings, to which a verb may add options of its own.
    """
    groups: dict[str, Any] = {"": parser}
    exclusive: dict[str, Any] = {}
    for one in declared(options).values():
        if one.group not in groups:
            groups[one.group] = parser.add_argument_group(one.group)
        place = groups[one.group]
        if rivals := one.option.exclusive:
            if rivals not in exclusive:
                exclusive[rivals] = place.add_mutually_exclusive_group()
            place = exclusive[rivals]
        _add(place, one)
    return groups


def add_option(place: argparse._ActionsContainer, name: str, option: Option, kind: type = str) -> None:
    """Add one option, None where not given, whose values are of a kind."""
    _add(place, Declared(name, kind, None, option, ""))


def _add(place: argparse._ActionsContainer, one: Declared) -> None:
    place.add_argument(one.flag, dest=one.name, help=_help(one), **_settings(one))


def _settings(one: Declared) -> dict[str, Any]:
    """Keywords of `add_argument` for an option."""
    if one.type is bool and one.option.read is None:
        return {"action": "store_const", "const": not one.value}
    read = one.option.read or one.type
    if read is int and one.option.range:
        read = whole_number(*map(int, one.option.range))
    settings: dict[str, Any] = {"type": read, "metavar": one.unit}
    if one.option.choices:
        settings["choices"] = one.option.choices
    if one.option.alone:
        settings |= {"nargs": "?", "const": one.option.alone}
    return settings | ({"action": "append"} if one.option.several else {})


def whole_number(lowest: int, highest: int) -> Callable[[str], int]:
    """A function that reads a whole number from `lowest` to `highest`, both included.

    The function raises argparse.ArgumentTypeError for any other text.
    """

    def read(text: str) -> int:
        # Python turns no more than some thousand digits into a number.
        if not (text.isdecimal() and len(text) <= LONGEST_NUMBER and lowest <= int(text) <= highest):
            raise argparse.ArgumentTypeError(
                f"{text[:LONGEST_NUMBER]!r} is not a whole number from {lowest} to {highest}"
            )
        return int(text)

    return read


def _help(one: Declared) -> str:
    default = one.option.default
    if default is None and one.type is not bool and isinstance(one.value, int | float | str):
        default = f"{one.value:g}" if isinstance(one.value, float) else str(one.value)
    return f"{one.option.help} (default: {default})" if default else one.option.help


def given(arguments: argparse.Namespace, *names: str) -> dict[str, Any]:
    """Those of the named options that are given, by name; `*declared(kind)` names those of a dataclass."""
    values = {name: getattr(arguments, name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def checked(options: object) -> None:
    """Raise InputError for the first value out of its range, and for None where None is no default."""
    for name, one in declared(type(options)).items():
        value = getattr(options, name)
        if value is None and one.value is not None:
            raise InputError(f"{name}: None is not allowed")
        if value is not None:
            one.check(value)


def part(options: object, kind: type[Kind]) -> Kind:
    """The value of a dataclass whose fields are among those of another."""
    return kind(**{field.name: getattr(options, field.name) for field in fields(kind) if field.init})  # type: ignore[arg-type]


def words(options: object) -> list[str]:
    """The command line of the options that differ from their defaults; none of them may be a list."""
    line = []
    for name, one in declared(type(options)).items():
        value = getattr(options, name)
        if value != one.value and value is not None:
            assert not isinstance(value, list | tuple), name
            text = f"{value:g}" if isinstance(value, float) else str(value)
            line += [one.flag] if one.type is bool else [f"{one.flag}={text}"]
    return line


def overrides(options: type, values: Mapping[str, Any]) -> list[str]:
    """Values as overrides `key=value` of a run file, whose strings TOML shares with JSON."""
    keys = {name: one.option.key for name, one in declared(options).items()}
    return [f"{keys[name]}={literal(value)}" for name, value in values.items() if keys.get(name)]


def literal(value: object) -> str:
    """A value as TOML: a number, true, false, or a string."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, int | float) else json.dumps(str(value), ensure_ascii=False)


@dataclass(frozen=True, kw_only=True)
class ProgressKeywords:
    """How a Python function shows its progress.

    Attributes:
        quiet: False shows progress on stderr, True nothing; None, a bar in a notebook and nothing elsewhere.
        progress: called with the progress, in place of showing it.
    """

    quiet: bool | None = None
    progress: "Callable[[Progress], None] | None" = None


def in_python(one: Declared) -> str:
    """What a keyword does, with its choices or its range."""
    option = one.option
    text = f"{'False: ' * (one.value is True)}{option.python or _help(one)}"
    text += f"; one of {', '.join(map(str, option.choices))}" * bool(option.choices)
    return text + (f"; from {option.range[0]:g} to {option.range[1]:g}" if option.range else "")


def _describe(called: Any, function: Callable[..., Any], options: Any) -> None:
    """Give a function that takes options as keywords the signature and the documentation of them."""
    own = inspect.signature(function)
    parameters = [parameter for parameter in own.parameters.values() if parameter.name != "options"]
    for keyword in inspect.signature(options).parameters.values():
        annotation = getattr(keyword.annotation, "__origin__", keyword.annotation)
        annotation = getattr(annotation, "__forward_arg__", annotation)
        parameters.append(keyword.replace(annotation=annotation))
    called.__signature__ = own.replace(parameters=parameters)
    lines = [f"    {name}: {in_python(one)}." for name, one in declared(options).items()]
    lines += ["    quiet, progress: how progress is shown, as in `optimize`."] * hasattr(options, "quiet")
    called.__doc__ = "\n".join((inspect.getdoc(function) or "", "", "Keywords:", *lines))


class by_keywords(Generic[Keywords, Kind]):
    """Let a function of one argument or three and `options` take the options as keywords.

    Args:
        options: a dataclass of keywords, which mypy and editors then know as those of the function.
    """

    def __init__(self, options: Callable[Keywords, Kind]) -> None:
        self.options: Callable[..., Kind] = options

    @overload
    def __call__(
        self, function: Callable[[A, Kind], Result]
    ) -> Callable[Concatenate[A, Keywords], Result]: ...

    @overload
    def __call__(
        self, function: Callable[[A, B, C, Kind], Result]
    ) -> Callable[Concatenate[A, B, C, Keywords], Result]: ...

    def __call__(self, function: Callable[..., Any]) -> Callable[..., Any]:
        names = set(inspect.signature(self.options).parameters)

        @functools.wraps(function)
        def called(*arguments: Any, **keywords: Any) -> Any:
            called.__signature__.bind(*arguments, **keywords)  # type: ignore[attr-defined]
            own = {name: value for name, value in keywords.items() if name not in names}
            chosen = {name: value for name, value in keywords.items() if name in names}
            return function(*arguments, options=self.options(**chosen), **own)

        _describe(called, function, self.options)
        return called

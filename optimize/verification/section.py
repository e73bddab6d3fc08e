"""Sections of a document in JSON: typed values that are read from JSON, checked, and written as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator

from tactile.quantities import QUANTITIES


@dataclass(frozen=True)
class Keys:
    """Where a value stands in JSON, if not under the name of its attribute.

    Attributes:
        names: keys of the value; the first counts, the others are its earlier names, written for one release.
        each: whether the value is a mapping by quantity, whose entries stand beside the other values of the
            section, under the name of the quantity; `names` are then what comes before this name.
    """

    names: tuple[str, ...]
    each: bool = False


class Section(BaseModel):
    """A section of a document; what a document lacks has its default, and is not written."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _gathered(cls, content: object) -> object:
        """The content by the names of the attributes."""
        if not isinstance(content, Mapping):
            return content
        gathered = dict(content)
        for name, keys in _keys_of(cls).items():
            # The first of the names, which counts, comes last.
            for key in reversed(keys.names):
                if keys.each:
                    values = {one: content[f"{key}{one}"] for one in QUANTITIES if f"{key}{one}" in content}
                    gathered |= {name: values} if values and name not in content else {}
                elif key in content and name not in content:
                    gathered[name] = content[key]
        return gathered

    def as_json(self) -> dict[str, Any]:
        """The section of JSON types, without the values that were not given."""
        content: dict[str, Any] = {}
        for name, keys in _keys_of(type(self)).items():
            if name not in self.model_fields_set:
                continue
            value = _plain(getattr(self, name))
            for key in keys.names:
                content |= {f"{key}{one}": each for one, each in value.items()} if keys.each else {key: value}
        return content


@cache
def _keys_of(section: type[Section]) -> Mapping[str, Keys]:
    """Keys of every attribute."""
    return {
        name: next((one for one in field.metadata if isinstance(one, Keys)), Keys((name,)))
        for name, field in section.model_fields.items()
    }


def _plain(value: Any) -> Any:
    """A value of JSON types."""
    if isinstance(value, Section):
        return value.as_json()
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value

"""Sections of a document in JSON: typed values that are read from JSON, checked, and written as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, SerializerFunctionWrapHandler, model_serializer, model_validator

from tactile.quantities import QUANTITIES


@dataclass(frozen=True)
class EachUnder:
    """Mark of a mapping by quantity, whose entries stand beside the other values of the section.

    Attributes:
        prefix: what comes before the name of the quantity in the key of an entry.
    """

    prefix: str


class Section(BaseModel):
    """A section of a document; what a document lacks has its default, and is not written."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, populate_by_name=True)

    @model_validator(mode="before")
    @classmethod
    def _gathered(cls, content: object) -> object:
        """The content, with mappings for entries of each quantity."""
        if not isinstance(content, Mapping):
            return content
        gathered = dict(content)
        for name, prefix in cls._prefixes():
            values = {one: content[f"{prefix}{one}"] for one in QUANTITIES if f"{prefix}{one}" in content}
            gathered |= {name: values} if values and name not in content else {}
        return gathered

    @model_serializer(mode="wrap")
    def _spread_out(self, serialized: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The content, with entries of each quantity for mappings."""
        content, prefixes = dict[str, Any](), dict(self._prefixes())
        for name, value in serialized(self).items():
            prefix = prefixes.get(name)
            each = {} if prefix is None else {f"{prefix}{one}": number for one, number in value.items()}
            content |= {name: value} if prefix is None else each
        return content

    def as_json(self) -> dict[str, Any]:
        """The section of JSON types, without the values that were not given."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)

    @classmethod
    def _prefixes(cls) -> Iterator[tuple[str, str]]:
        """Attributes that are mappings by quantity, and what comes before the names in their keys."""
        for name, field in cls.model_fields.items():
            yield from ((name, one.prefix) for one in field.metadata if isinstance(one, EachUnder))

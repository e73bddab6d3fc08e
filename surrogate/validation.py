"""JSON from files that nobody vouches for: parsed by a pydantic type, or refused in one line."""

from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from relief.ground.errors import InputError

T = TypeVar("T")


def parse_json(adapter: TypeAdapter[T], text: bytes | str, where: str) -> T:
    """Parse JSON and check it against a type.

    Args:
        adapter: The type that the text must match.
        text: JSON.
        where: The file, and the place in it, for the message.

    Returns:
        The value.

    Raises:
        InputError: The text does not match; the message names ``where`` and the first field at fault.
    """
    try:
        return adapter.validate_json(text)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]
        # A texture of a manifest is a union; pydantic adds the tag of its member to the place.
        place = ".".join(str(part) for part in problem["loc"] if part not in ("recipe", "optimised"))
        message = " ".join(problem["msg"].split())
        raise InputError(f"{where}: {place}: {message}" if place else f"{where}: {message}") from error

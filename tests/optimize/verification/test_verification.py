"""A verification is read back from result.json as it was written, or not at all."""

import json
from typing import Any

import pytest

from optimize.verification.verification import Verification
from tests.retouch.pages.plausible import content


def test_what_was_written_is_read_back() -> None:
    verification = Verification.from_json(content(2))
    again = Verification.from_json(json.loads(json.dumps(verification.as_json())))
    assert again == verification


@pytest.mark.parametrize("value", ["1e999", "nan", "-inf", "1e301", float("inf"), 1e301])
def test_a_number_that_is_none_is_refused_though_it_is_spelt_as_one(value: Any) -> None:
    damaged = content(2)
    damaged["touch"] = damaged["touch"] | {"contact_fraction": value}
    with pytest.raises(ValueError, match=r"may not be shown|finite"):
        Verification.from_json(damaged)


def test_a_text_that_a_terminal_would_obey_is_refused() -> None:
    damaged = content(2)
    damaged["stop"] = damaged["stop"] | {"message": "\x1b[2J"}
    with pytest.raises(ValueError, match="may not be shown"):
        Verification.from_json(damaged)

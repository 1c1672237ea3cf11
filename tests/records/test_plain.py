"""Plain data becomes what it should be, or one line says what does not fit."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from exneat_cli.errors import ConfigError, ExneatError
from exneat_cli.records import Manifest, build, converted
from exneat_cli.records.plain import read_json


@dataclass(frozen=True)
class Leg:
    length: float
    joints: tuple[str, ...] = ()


@dataclass(frozen=True)
class Body:
    name: str
    trunk: Leg = field(default_factory=lambda: Leg(1.0))
    legs: tuple[Leg, ...] = ()

    def __post_init__(self) -> None:
        if not self.name:
            raise ConfigError("name", "a name", self.name)


def test_dataclasses_within_a_dataclass_are_made_of_their_sections() -> None:
    made = build(Body, {"name": "ant", "trunk": {"length": 2}, "legs": [{"length": 3, "joints": ("hip",)}, Leg(4)]})
    assert made == Body("ant", Leg(2), (Leg(3, ("hip",)), Leg(4)))
    assert build(Body, {"name": "ant", "trunk": Leg(5)}).trunk == Leg(5)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"name": "ant", "leg": 1}, "body.leg: unknown key (value 1)\n  did you mean body.legs?"),
        ({"name": "ant", "wings": 1}, "body.wings: unknown key (value 1)\n  known here: name, trunk, legs"),
        ({"name": "ant", "trunk": {"lenght": 1}}, "did you mean body.trunk.length?"),
        ({"name": "ant", "trunk": 1}, "body.trunk: expected a section with keys of its own, got 1"),
        ({"name": "ant", "legs": [{}]}, "body.legs[0].length: is missing"),
        ({}, "body.name: is missing"),
        ({"name": ""}, "name: expected a name, got ''"),
    ],
)
def test_a_key_that_does_not_fit_is_named_with_the_nearest_valid_one(values: dict[str, Any], said: str) -> None:
    with pytest.raises(ExneatError) as refused:
        build(Body, values, "body.")
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("content", "kind", "said"),
    [
        ({"a": ["x"]}, dict[str, list[int]], "x.json: [...][0]: expected a whole number, got {'a': ['x']}"),
        ([10**5000], list[float], "[0]: number out of range"),
    ],
)
def test_what_was_expected_and_what_came_are_said_in_one_line(content: Any, kind: Any, said: str) -> None:
    with pytest.raises(ExneatError) as refused:
        converted(content, kind, "x.json")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (b"", "expected JSON"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"format": NaN}', "expected JSON"),
        (b'{"format": 1e999}', "Number out of range"),
        (b'{"format": ' + b"9" * 5000 + b"}", "expected JSON"),
        (b"[1]", "expected a JSON object, got list"),
        (b"{}", "expected format 3, got None: exneat did not write it"),
        (b'{"format": 2}', "expected format 3, got 2: another version of exneat wrote it"),
        (b'{\n"a": "\xff"}', "expected UTF-8 text, got the byte 0xff"),
    ],
    ids=lambda text: text[:20],
)
def test_what_is_no_json_of_this_format_is_refused_in_one_line(text: bytes, named: str, tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(text)
    with pytest.raises(ExneatError, match=rf"x\.json(:2)?: .*{named}") as refused:
        read_json(path, Manifest, 3)
    assert "\n" not in str(refused.value)

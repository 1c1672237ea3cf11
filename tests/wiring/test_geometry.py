"""Which modules share genomes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exneat_cli.errors import ConfigError
from exneat_cli.tasks import AntTask, Part
from exneat_cli.wiring import Geometry


def parts(count: int) -> tuple[Part, ...]:
    return tuple(Part(f"s{k}", (k,), (k,), (float(k), 0.0)) for k in range(count))


@pytest.mark.parametrize(
    ("name", "vector"),
    [
        ("single", (0, 0, 0, 0)),
        ("fb", (0, 0, 1, 1)),
        ("lr", (0, 1, 0, 1)),
        ("cross", (0, 1, 1, 0)),
        ("all", (0, 1, 2, 3)),
    ],
)
def test_named_geometries_on_ant_are_those_of_the_design(name: str, vector: tuple[int, ...]) -> None:
    assert Geometry(name).subpopulations(AntTask().parts) == vector
    assert Geometry(name).subpopulations(AntTask(part_order="model").parts) == vector


def test_by_position_fb_pairs_front_legs_and_by_model_order_left_legs() -> None:
    def first_pair(order: str) -> set[str]:
        legs = AntTask(part_order=order).parts
        vector = Geometry("fb").subpopulations(legs)
        return {leg.name for leg, entry in zip(legs, vector, strict=True) if entry == 0}

    assert first_pair("position") == {"front_left", "front_right"}
    assert first_pair("model") == {"front_left", "back_left"}


@given(st.lists(st.integers(0, 5), min_size=1, max_size=10))
def test_custom_vectors_are_renumbered_by_first_appearance_or_refused_for_gaps(vector: list[int]) -> None:
    if set(vector) != set(range(max(vector) + 1)):
        with pytest.raises(ConfigError, match="without gaps"):
            Geometry("custom", tuple(vector))
        return
    numbered = Geometry("custom", tuple(vector)).subpopulations(parts(len(vector)))
    assert [vector.index(entry) for entry in vector] == [numbered.index(entry) for entry in numbered]
    assert list(dict.fromkeys(numbered)) == list(range(len(set(vector))))


@given(st.integers(1, 12))
def test_single_and_all_fit_any_number_of_parts(count: int) -> None:
    assert set(Geometry("single").subpopulations(parts(count))) == {0}
    assert Geometry("all").subpopulations(parts(count)) == tuple(range(count))


@pytest.mark.parametrize("name", ["fb", "lr", "cross"])
def test_leg_geometries_are_refused_without_legs(name: str) -> None:
    with pytest.raises(ConfigError, match="geometry: expected single, all or custom"):
        Geometry(name).subpopulations(parts(4))


@pytest.mark.parametrize(
    ("name", "vector"),
    [
        ("custom", None),
        ("custom", ()),
        ("custom", (0, -1)),
        ("custom", (0, 1.0)),
        ("custom", (0, True)),
        ("all", (0, 1)),
    ],
)
def test_missing_or_superfluous_vectors_are_refused(name: str, vector: tuple[int, ...] | None) -> None:
    with pytest.raises(ConfigError, match=r"geometry\.vector"):
        Geometry(name, vector)


def test_a_vector_of_the_wrong_length_is_refused_with_the_names_of_the_parts() -> None:
    with pytest.raises(ConfigError, match="4 entries, one for each of front_left"):
        Geometry("custom", (0, 1)).subpopulations(AntTask().parts)

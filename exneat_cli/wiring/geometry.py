"""Geometry: which modules share genomes.

Source: Zhang (2025), section 3.1; `cross` as described there (the two diagonals), not as printed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from exneat_cli.errors import ConfigError, check_choice
from exneat_cli.tasks import Part

QUADRUPED_VECTORS = {"fb": (0, 0, 1, 1), "lr": (0, 1, 0, 1), "cross": (0, 1, 1, 0)}
"""Geometry vectors that need four legs, for the order front left, front right, back left, back right."""
QUADRUPED_PARTS = {"front_left", "front_right", "back_left", "back_right"}
GEOMETRIES = ("single", *QUADRUPED_VECTORS, "all", "custom")


@dataclass(frozen=True)
class Geometry:
    """Which modules share genomes, by name or, for `custom`, by vector.

    Attributes:
        name: one of `GEOMETRIES`.
        vector: for `custom` alone, the subpopulation of each part's module, e.g. ``(0, 0, 1, 0)``.

    Raises:
        ConfigError: the name is unknown, or the vector is missing, superfluous or has gaps.
    """

    name: str = "single"
    vector: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        check_choice("geometry", self.name, GEOMETRIES)
        if self.name != "custom":
            if self.vector is not None:
                fix = f"leave geometry.vector out, or use geometry=custom instead of geometry={self.name}"
                raise ConfigError("geometry.vector", "nothing (null)", self.vector, fix)
            return
        expected = "a list of whole numbers without gaps, e.g. [0,0,1,1]"
        if not isinstance(self.vector, list | tuple) or not self.vector:
            raise ConfigError("geometry.vector", expected, self.vector)
        if any(isinstance(entry, bool) or not isinstance(entry, int) or entry < 0 for entry in self.vector):
            raise ConfigError("geometry.vector", expected, list(self.vector))
        if len(set(self.vector)) <= max(self.vector):
            raise ConfigError("geometry.vector", expected, list(self.vector))
        object.__setattr__(self, "vector", tuple(self.vector))

    def subpopulations(self, parts: Sequence[Part]) -> tuple[int, ...]:
        """Subpopulation of each part's module, numbered by first appearance.

        Raises:
            ConfigError: the geometry does not fit these parts.
        """
        if self.name == "single":
            return (0,) * len(parts)
        if self.name == "all":
            return tuple(range(len(parts)))
        if self.name in QUADRUPED_VECTORS:
            if {part.name for part in parts} != QUADRUPED_PARTS:
                names = ", ".join(part.name for part in parts)
                raise ConfigError("geometry", "single, all or custom", self.name, f"this task has: {names}")
            return QUADRUPED_VECTORS[self.name]
        assert self.vector is not None
        if len(self.vector) != len(parts):
            names = ", ".join(part.name for part in parts)
            expected = f"{len(parts)} entries, one for each of {names}"
            raise ConfigError("geometry.vector", expected, list(self.vector))
        first_seen = list(dict.fromkeys(self.vector))
        return tuple(first_seen.index(entry) for entry in self.vector)

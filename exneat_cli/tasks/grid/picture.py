"""Grid worlds as pictures: red is channel 1, blue channel 2, black wall, green the agent, yellow goal or free prey."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Snapshot = tuple[NDArray[np.float64], tuple[int, int], list[tuple[int, int]]]
"""Tiles, (N, N, 3), see `exneat_cli.tasks.HasTiles`; row and column of the agent, and of each target."""


def coloured(tiles: NDArray[np.float64], agent: tuple[int, int], targets: list[tuple[int, int]]) -> NDArray[np.float64]:
    """(N, N, 3) one colour per tile, between 0 and 1."""
    # Tiles without cues are white; channel 1 removes green and blue and leaves red, channel 2 removes red and green.
    # Tiles with strong cues on both are purple, and so differ from walls.
    cues = np.clip(tiles[..., 1:], 0.0, 1.0)
    colours = np.stack([1.0 - 0.7 * cues[..., 1], 1.0 - cues.max(axis=2), 1.0 - 0.7 * cues[..., 0]], axis=2)
    colours[tiles[..., 0] == 0] = 0.0
    for row, column in targets:
        colours[row, column] = (1.0, 0.85, 0.0)
    colours[agent] = (0.0, 0.6, 0.2)
    return colours


def enlarged(colours: NDArray[np.float64], pixels: int) -> NDArray[np.uint8]:
    """(N * pixels, N * pixels, 3) the colours, with `pixels` x `pixels` pixels per tile."""
    picture = np.kron(colours, np.ones((pixels, pixels, 1)))
    return np.asarray(255 * picture, np.uint8)


class GridCamera:
    """Draws snapshots on grey, as large as a whole number of pixels per tile allows."""

    def __init__(self, width: int, height: int) -> None:
        self._size = height, width

    def draw(self, snapshot: Snapshot) -> NDArray[np.uint8]:
        """(height, width, 3) the picture of a snapshot."""
        colours = coloured(*snapshot)
        height, width = self._size
        tiles = enlarged(colours, max(1, min(self._size) // len(colours)))[:height, :width]
        picture = np.full((height, width, 3), 235, np.uint8)
        top, left = (height - tiles.shape[0]) // 2, (width - tiles.shape[1]) // 2
        picture[top : top + tiles.shape[0], left : left + tiles.shape[1]] = tiles
        return picture

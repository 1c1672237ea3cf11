"""Draw docs/images/hexapod.png: the hexapod from above, coloured by the networks that `geometry=auto` shares.

python docs/draw_robot.py [file]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import mujoco
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from exneat_cli.tasks import RobotTask
from exneat_cli.wiring import Geometry

COLOURS = ("#0072b2", "#e69f00", "#009e73")
OUTWARDS = 1.95
"""How far out a part's name stands, as a multiple of how far its outermost body is from the trunk's centre."""


def draw(path: Path) -> None:
    """Write the picture: x (ahead) up, y (left) to the left."""
    matplotlib.rcParams.update({"font.family": "DejaVu Sans", "font.size": 9})
    task = RobotTask(model="hexapod")
    model, data = task.open(training=False).owner  # type: ignore[misc]
    mujoco.mj_forward(model, data)
    figure = Figure(figsize=(7.2, 5.5), facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    trunk = data.xpos[1]
    axes.plot(*seen(trunk), "o", color="#bbbbbb", markersize=56)
    ahead = np.array([0.15, 0.0, 0.0])
    axes.annotate("", seen(trunk + ahead), seen(trunk - ahead), arrowprops={"arrowstyle": "-|>"})
    for part, network in zip(task.parts, Geometry("auto").subpopulations(task.parts), strict=True):
        remarks = task.remarks_on(part)
        bodies = remarks["bodies"].split(", ")
        for body in map(data.body, bodies):
            for geom in np.flatnonzero(model.geom_bodyid == body.id):
                along = data.geom_xmat[geom].reshape(3, 3)[:, 2] * model.geom_size[geom, 1]
                ends = np.stack([seen(data.geom_xpos[geom] - along), seen(data.geom_xpos[geom] + along)])
                axes.plot(*ends.T, color=COLOURS[network], linewidth=11, alpha=0.75, solid_capstyle="round")
        reach = OUTWARDS * (data.geom_xpos[model.geom_bodyid == data.body(bodies[-1]).id][0] - trunk)
        words = f"{part.name} (network {network})\n{remarks['joints'].replace(', ', chr(10))}"
        axes.text(*seen(trunk + reach), words, ha="center", va="center", color=COLOURS[network], linespacing=1.4)
    axes.set(xlim=(-2.1, 2.1), ylim=(-1.6, 1.6), aspect="equal")
    axes.axis("off")
    figure.savefig(path, dpi=110, metadata={"Software": None})


def seen(place: np.ndarray) -> np.ndarray:
    """(2,) on the page of a place on the ground."""
    return np.array([-place[1], place[0]])


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images" / "hexapod.png")

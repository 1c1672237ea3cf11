"""Draw docs/images/modules.svg: NEAT's one network and ExNEAT's modules on Ant's body, from the wiring plans.

python docs/draw_modules.py [file]
"""

from __future__ import annotations

import sys
from importlib import resources
from pathlib import Path

import matplotlib
import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch
from matplotlib.text import Text

from exneat_cli.runs import RunSettings
from exneat_cli.wiring import Geometry, Module, Plan

COLOURS = {
    "front_left": "#0072b2",
    "front_right": "#009e73",
    "back_left": "#cc79a7",
    "back_right": "#e69f00",
    "central": "#444444",
    "body": "#444444",
}
SPREAD = 4.1
"""How far from the trunk a leg's module is drawn, as a multiple of where its hip is."""


def draw(path: Path) -> None:
    """Write the picture."""
    matplotlib.rcParams.update({"svg.hashsalt": "modules", "font.family": "DejaVu Sans", "font.size": 9})
    figure = Figure(figsize=(8.6, 3.5), facecolor="white")
    FigureCanvasAgg(figure)
    plans = {
        "NEAT: one network": RunSettings(algorithm="neat").plan,
        "ExNEAT: a module per leg, and a central one": RunSettings(geometry=Geometry("all")).plan,
    }
    model = ant()
    panels = figure.subplots(1, 2)
    figure.subplots_adjust(0.0, 0.01, 1.0, 0.92, wspace=0.0)
    for axes, (title, plan) in zip(panels, plans.items(), strict=True):
        draw_body(axes, model)
        draw_plan(axes, model, plan)
        axes.set_title(title, fontsize=10.5, fontweight="bold")
    figure.savefig(path, metadata={"Date": None})


def ant() -> mujoco.MjModel:
    """Gymnasium's model of Ant."""
    asset = resources.files("gymnasium") / "envs" / "mujoco" / "assets" / "ant.xml"
    return mujoco.MjModel.from_xml_string(asset.read_text(encoding="utf-8"))


def draw_body(axes: Axes, model: mujoco.MjModel) -> None:
    """The body from above, x (ahead) to the right, and its hinges as dots."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE):
        centre, axis = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)[:, 2]
        ends = np.stack([centre - axis * model.geom_size[geom, 1], centre + axis * model.geom_size[geom, 1]])
        axes.plot(ends[:, 0], ends[:, 1], color="#dddddd", linewidth=11, solid_capstyle="round", zorder=1)
    axes.add_patch(Circle((0, 0), 0.25, color="#dddddd", zorder=1))
    for x, y in hinges(model):
        axes.plot(x, y, "o", color="#d55e00", markersize=5, zorder=6)
    axes.annotate("", (1.38, 0), (1.13, 0), arrowprops={"arrowstyle": "-|>", "color": "#999999"})
    axes.text(1.26, 0.06, "ahead", ha="center", color="#999999", fontsize=8)
    axes.set(xlim=(-1.45, 1.45), ylim=(-1.08, 1.08), aspect="equal")
    axes.axis("off")


def hinges(model: mujoco.MjModel) -> np.ndarray:
    """(8, 2) where the driven joints are, in the order of the action."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return np.array(data.xanchor[model.actuator_trnid[:, 0], :2])


def draw_plan(axes: Axes, model: mujoco.MjModel, plan: Plan) -> None:
    """A box per module, an arrow for what a module reads of another, a dotted line to each hinge that it drives."""
    boxes = [draw_module(axes, module) for module in plan.modules]
    axes.figure.canvas.draw()  # only then boxes have a size, at which arrows end
    for module, box in zip(plan.modules, boxes, strict=True):
        for source in {pin.module for pin in module.pins if not pin.is_sensor}:
            name = plan.modules[source].name
            style = f"arc3,rad={0.3 if name in ('front_left', 'back_right') else -0.3}"
            arrow = FancyArrowPatch(
                boxes[source].get_position(),
                box.get_position(),
                patchA=boxes[source].get_bbox_patch(),
                patchB=box.get_bbox_patch(),
                arrowstyle="-|>",
                mutation_scale=11,
                connectionstyle=style,
                color=COLOURS[name],
                linewidth=1.6,
                zorder=3,
            )
            axes.add_patch(arrow)
        for x, y in hinges(model)[list(module.drives)]:
            axes.plot([0, x], [0, y], color="#d55e00", linewidth=1.2, linestyle=":", zorder=2)


def draw_module(axes: Axes, module: Module) -> Text:
    """A module where its part is, drawn out along the leg."""
    frame = {"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": COLOURS[module.name], "linewidth": 1.8}
    x, y = np.array(module.position) * SPREAD
    style = {"ha": "center", "va": "center", "fontsize": 7.5, "linespacing": 1.35}
    return axes.text(x, y, words(module), bbox=frame, zorder=5, **style)


def words(module: Module) -> str:
    """Name, sensors, what is read of other modules, outputs."""
    reads = len(module.pins) - len(module.sensors)
    inputs = f"{len(module.sensors)} sensors" + (f"\n{reads} outputs of modules" if reads else "")
    drives = f"drives {len(module.drives)} hinges" if module.drives else f"{module.outputs} outputs"
    return f"{module.name.replace('_', ' ')}\n{inputs}\n{drives}"


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images" / "modules.svg")

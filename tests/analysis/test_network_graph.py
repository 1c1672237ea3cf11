"""Champions as graphs: what is in them, where it stands, and what is told apart."""

from __future__ import annotations

from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, FancyArrowPatch, FancyBboxPatch

from exneat_cli.analysis.champion_graph import (
    MOST_EDGES,
    depths,
    edges_of,
    hidden_of,
    links_of,
    strongest_edges,
    used_nodes,
)
from exneat_cli.analysis.network_graph import FAINT, NEGATIVE, POSITIVE, draw_champion, draw_network, legend_entries
from exneat_cli.analysis.network_layout import lay_out, natural_size
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory, write_json
from exneat_cli.records.champion import Champion
from tests.analysis.fake_champions import (
    a_champion,
    a_genome,
    a_module,
    champion_of,
    grid_champion,
    modular_champion,
    reads,
)
from tests.analysis.fake_studies import contents, has_white_edges

FRONT_LEFT, FRONT_RIGHT, BACK_LEFT, BACK_RIGHT, CENTRAL = range(5)


def layered(hidden: list[int], *connections: tuple[int, int]) -> dict[int, int]:
    """The layers of the hidden nodes of one module."""
    edges = [((0, source), (0, target), 1.0) for source, target in connections]
    return {key: layer for (_, key), layer in depths([(0, key) for key in hidden], edges).items() if key >= 0}


def test_a_hidden_node_stands_one_layer_above_its_deepest_source() -> None:
    # 2 reads an input, 3 reads 2, 4 reads 2 and 3, and 5 reads nothing.
    assert layered([2, 3, 4, 5], (-1, 2), (2, 3), (2, 4), (3, 4), (4, 0)) == {2: 1, 3: 2, 4: 3, 5: 1}
    # Connections out of outputs and to oneself deepen nothing.
    assert layered([2, 3], (-1, 2), (0, 2), (2, 2), (-1, 3), (1, 3)) == {2: 1, 3: 1}


def test_a_cycle_is_entered_where_inputs_reach_it() -> None:
    # 3 -> 4 -> 2 -> 3, and the input reaches 4 alone.
    assert layered([2, 3, 4], (3, 4), (4, 2), (2, 3), (-1, 4)) == {4: 1, 2: 2, 3: 3}


def laid_out(content: dict[str, Any]) -> Any:
    champion = champion_of(content)
    return lay_out(champion, *natural_size(champion))


def test_layers_rise_from_inputs_to_outputs_and_step_aside_for_connections_that_pass_them() -> None:
    _, places = laid_out(grid_champion())
    assert all(places[0, low][1] < places[0, high][1] for low, high in pairwise((-1, 2, 3, 0)))
    assert places[0, -1][1] == places[0, -2][1]
    assert places[0, 0][1] == places[0, 1][1]
    # The second input feeds output 1 directly, straight through where the faint node 4 would stand.
    assert places[0, -2][0] == pytest.approx(places[0, 1][0])
    assert abs(places[0, 4][0] - places[0, 1][0]) > 0.08


@pytest.mark.parametrize("content", [grid_champion(), modular_champion()], ids=["grid", "modular"])
def test_every_node_stands_inside_the_box_of_its_module(content: dict[str, Any]) -> None:
    champion = champion_of(content)
    boxes, places = laid_out(content)
    shown = [(m, key) for m, each in enumerate(champion.plan.modules) for key in range(-len(each.pins), each.outputs)]
    assert set(places) == {*shown, *hidden_of(champion)}
    assert all(boxes[m].contains(*place) for (m, _), place in places.items())


def test_a_node_is_used_on_a_path_from_a_sensor_to_an_actuator_by_way_of_any_module() -> None:
    assert used_nodes(champion_of(grid_champion())) == {(0, key) for key in (-1, -2, 0, 1, 2, 3)}
    used = used_nodes(champion_of(modular_champion()))
    assert (BACK_RIGHT, 0) not in used, "nothing reads its output"
    assert (BACK_RIGHT, 1) in used, "the back left leg reads its hidden node"
    assert all((leg, 0) in used for leg in (FRONT_LEFT, FRONT_RIGHT, BACK_LEFT))


def test_a_disabled_connection_is_neither_drawn_nor_a_path() -> None:
    content = grid_champion()
    content["genomes"][0]["connections"][0]["enabled"] = False
    champion = champion_of(content)
    assert all(source != (0, -1) for source, _, _ in edges_of(champion))
    assert used_nodes(champion) == {(0, -2), (0, 1)}


def test_links_run_between_the_modules_that_the_plan_names_unless_the_node_was_deleted() -> None:
    content = modular_champion()
    links = links_of(champion_of(content))
    delayed = {(source, target) for source, target, is_delayed in links if is_delayed}
    prompt = {(source, target) for source, target, is_delayed in links if not is_delayed}
    # Each leg's third pin reads the hidden node of the next leg, which is node 1.
    assert delayed == {(((k + 1) % 4, 1), (k, -3)) for k in range(4)}
    assert prompt == {((leg, 0), (CENTRAL, -2 - leg)) for leg in range(3)}
    content["genomes"][0] = a_genome([0], [(-1, 0, 0.5)])
    assert not any(is_delayed for _, _, is_delayed in links_of(champion_of(content)))


def test_modules_stand_on_the_page_as_on_the_body() -> None:
    boxes, _ = laid_out(modular_champion())
    (x, y) = zip(*((box.x0, box.y0) for box in boxes), strict=True)
    assert x[FRONT_LEFT] == x[BACK_LEFT] < x[CENTRAL] < x[FRONT_RIGHT] == x[BACK_RIGHT]
    assert y[FRONT_LEFT] == y[FRONT_RIGHT] > y[CENTRAL] > y[BACK_LEFT] == y[BACK_RIGHT]


def test_the_parts_of_a_map_keep_its_directions() -> None:
    sides = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)}
    modules = [
        a_module(name, place, 0, pins=[reads(k)], outputs=1, drives=[k])
        for k, (name, place) in enumerate(sides.items())
    ]
    boxes, _ = laid_out(a_champion(modules, [a_genome([0], [(-1, 0, 1.0)])], list(sides), 4))
    left, right, up, down = ((box.x0, box.y0) for box in boxes)
    assert left[0] < up[0] == down[0] < right[0]
    assert down[1] < left[1] == right[1] < up[1]


def axes_of(champion: Champion) -> Axes:
    axes = Figure().add_subplot()
    draw_champion(axes, champion, *natural_size(champion))
    return axes


def test_colour_tells_the_sign_width_the_size_and_faintness_the_unused() -> None:
    axes = axes_of(champion_of(grid_champion()))
    (edges,) = [each for each in axes.collections if isinstance(each, LineCollection)]
    # Lightest first: 0.3, -0.5, 1.0 (unused), -1.0, 1.5 and 2.0; the connection to itself is a loop.
    colours = [POSITIVE, NEGATIVE, POSITIVE, NEGATIVE, POSITIVE, POSITIVE]
    assert [tuple(colour[:3]) for colour in edges.get_colors()] == [to_rgb(colour) for colour in colours]
    assert [colour[3] == FAINT for colour in edges.get_colors()] == [False, False, True, False, False, False]
    widths = list(edges.get_linewidths())
    assert widths == sorted(widths)
    assert widths[0] < widths[1] < widths[4]
    assert sum(isinstance(patch, Ellipse) for patch in axes.patches) == 1


def test_links_are_dashed_where_delayed_and_sensors_outputs_and_modules_carry_their_names() -> None:
    axes = axes_of(champion_of(modular_champion()))
    links = [patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)]
    assert [link.get_linestyle() == "-" for link in links] == [False] * 4 + [True] * 3
    texts = {text.get_text() for text in axes.texts}
    assert {f"eye {k} (cd)" for k in range(9)} <= texts
    assert {"hip 1\n(3 N m)", "ankle 1", "front left  (genome 1, shared by 4)", "central"} <= texts
    assert {"hidden 0 of front right", "output 0 of back left"} <= texts


@pytest.mark.parametrize("modules", [1, 3], ids=["alone", "between two others"])
def test_names_of_many_actuators_do_not_overprint(modules: int) -> None:
    joints = [
        f"{side} {joint} {axis} (40 N m)" for side in ("left", "right") for joint in ("hip", "arm") for axis in "xyzw"
    ]
    body = a_module("body", (0.0, 0.0), 0, pins=[reads(0)], outputs=len(joints), drives=list(range(len(joints))))
    sides = [a_module(f"eye {y}", (0.0, y), 1, pins=[reads(0)], outputs=1) for y in (1.0, -1.0)]
    genomes = [a_genome(range(outputs), [(-1, 0, 1.0)]) for outputs in (len(joints), 1)]
    champion = champion_of(a_champion([body, *sides][:modules], genomes[:modules], joints, 1))
    axes = Figure(figsize=natural_size(champion)).add_axes((0.0, 0.0, 1.0, 1.0))
    draw_champion(axes, champion, *natural_size(champion))
    assert set(joints) <= {text.get_text().replace("\n", " ") for text in axes.texts}
    axes.figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in axes.texts]
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    assert all(axes.get_window_extent().containsx(box.x0) for box in boxes)


def test_inputs_that_are_too_many_to_be_named_are_counted() -> None:
    body = a_module("body", (0.0, 0.0), 0, pins=[reads(k) for k in range(200)], outputs=1, drives=[0])
    axes = axes_of(champion_of(a_champion([body], [a_genome([0], [(-1, 0, 1.0)])], ["hip"], 200)))
    assert {text.get_text() for text in axes.texts} == {"body", "hip", "200 eye (cd)"}


def test_the_legend_speaks_of_links_and_loops_only_where_there_are_any() -> None:
    grid, modular = (
        " ".join(str(entry.get_label()) for entry in legend_entries([champion_of(content)]))
        for content in (grid_champion(), modular_champion())
    )
    assert "link" not in grid
    assert "loop" in grid
    assert "one step late" in modular
    assert "loop" not in modular


def a_run(directory: Path, content: dict[str, Any]) -> RunDirectory:
    directory.mkdir(parents=True)
    run = RunDirectory(directory)
    write_json(run.champion, content)
    return run


@pytest.mark.parametrize("content", [grid_champion(), modular_champion()], ids=["grid", "modular"])
def test_the_same_champion_gives_the_same_bytes_and_nothing_is_cut_off(tmp_path: Path, content: dict[str, Any]) -> None:
    one, other = (a_run(tmp_path / place / "run", content) for place in ("a", "b"))
    picture, _ = draw_network(one)
    draw_network(other)
    assert sorted(contents(one.plots)) == ["network.png", "network.svg"]
    assert contents(one.plots) == contents(other.plots)
    assert has_white_edges(picture)


def test_a_missing_or_damaged_champion_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match="baselines and unfinished runs have no network"):
        draw_network(RunDirectory(tmp_path / "random-s0"))
    content = grid_champion()
    content["genomes"][0]["connections"][0]["to"] = 77
    with pytest.raises(ExneatError, match=r"champion\.json: damaged.*") as raised:
        draw_network(a_run(tmp_path / "run", content))
    assert "\n" not in str(raised.value)


def test_no_two_modules_of_a_body_have_one_colour() -> None:
    legs = [a_module(f"leg {k}", (0.0, float(k)), 0, pins=[reads(0)], outputs=1, drives=[k]) for k in range(24)]
    joints = [f"hip {k}" for k in range(24)]
    axes = axes_of(champion_of(a_champion(legs, [a_genome([0], [(-1, 0, 1.0)])], joints, 1)))
    boxes = [patch for patch in axes.patches if isinstance(patch, FancyBboxPatch)]
    assert len({box.get_edgecolor() for box in boxes}) == len(boxes) == 24


def test_many_sensors_stand_by_quantity_and_of_many_connections_the_strongest_are_drawn() -> None:
    quantities = ("velocity x (m/s)", "contact force, left (N)", "angle (rad)")
    names = [f"leg {k} {quantity}" for k in range(30) for quantity in quantities]
    connections = [(-1 - k, output, 0.01 * (1 + k + 90 * output)) for k in range(90) for output in range(4)]
    body = a_module("body", (0.0, 0.0), 0, pins=[reads(k) for k in range(90)], outputs=4, drives=[0, 1, 2, 3])
    content = a_champion([body], [a_genome(range(4), connections)], ["a", "b", "c", "d"], 90)
    champion = champion_of({**content, "sensors": names})
    axes = Figure().add_subplot()
    draw_champion(axes, champion, 12.0, 6.0)
    words = [text.get_text() for text in axes.texts]
    assert {"30 velocity (m/s)", "30 force (N)", "30 angle (rad)"} <= set(words)
    assert not set(names) & set(words)
    (lines,) = (each for each in axes.collections if isinstance(each, LineCollection))
    assert len(lines.get_segments()) == MOST_EDGES
    assert "left out: the 110 weakest connections" in [entry.get_label() for entry in legend_entries([champion])]
    assert min(abs(weight) for _, _, weight in strongest_edges(champion)) == pytest.approx(0.01 * 111)

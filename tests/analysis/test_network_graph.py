"""Champions as graphs: what is in them, where it stands, and what is told apart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, PathPatch

from exneat_cli.algorithms import ALGORITHMS, EvolutionSettings, Problem
from exneat_cli.analysis.network_data import ChampionGraph, champion_graph, read_champion_graph
from exneat_cli.analysis.network_graph import FAINT, NEGATIVE, POSITIVE, draw_champion, draw_network, legend_entries
from exneat_cli.analysis.network_layout import Layout, depths, lay_out, natural_size, page_direction
from exneat_cli.errors import ExneatError
from exneat_cli.records import Champion, RunDirectory, write_champion, write_json
from exneat_cli.tasks import AntTask
from exneat_cli.wiring import Geometry, Wiring
from tests.analysis.figure_studies import (
    a_champion,
    a_genome,
    a_module,
    a_pin,
    grid_champion,
    has_white_edges,
    modular_champion,
)

LEGS = {"front_left": 0, "front_right": 1, "back_left": 2, "back_right": 3, "central": 4}


def laid_out(content: dict[str, Any]) -> tuple[ChampionGraph, Layout]:
    graph = champion_graph(content)
    return graph, lay_out(graph, *natural_size(graph))


def centre(layout: Layout, m: int) -> tuple[float, float]:
    box = layout.boxes[m]
    return box.x + box.width / 2, box.y + box.height / 2


def test_a_hidden_node_stands_one_layer_above_its_deepest_source() -> None:
    # 2 reads an input, 3 reads 2, 4 reads 2 and 3, and 5 reads nothing.
    assert depths([2, 3, 4, 5], [(-1, 2), (2, 3), (2, 4), (3, 4), (4, 0)]) == {2: 1, 3: 2, 4: 3, 5: 1}


def test_connections_out_of_outputs_and_to_oneself_deepen_nothing() -> None:
    assert depths([2, 3], [(-1, 2), (0, 2), (2, 2), (-1, 3), (1, 3)]) == {2: 1, 3: 1}


def test_a_cycle_is_entered_where_inputs_reach_it() -> None:
    # 3 -> 4 -> 2 -> 3, and the input reaches 4 alone.
    assert depths([2, 3, 4], [(3, 4), (4, 2), (2, 3), (-1, 4)]) == {4: 1, 2: 2, 3: 3}


def test_layers_rise_from_inputs_to_outputs() -> None:
    _, layout = laid_out(grid_champion())
    heights = [layout.places[0, node][1] for node in (-1, 2, 3, 0)]
    assert heights == sorted(heights)
    assert len(set(heights)) == 4
    assert layout.places[0, -1][1] == layout.places[0, -2][1]
    assert layout.places[0, 0][1] == layout.places[0, 1][1]


def test_a_connection_never_seems_to_end_at_a_node_that_it_only_passes() -> None:
    # The second input feeds output 1 directly, straight through where the faint node 4 would stand.
    graph, layout = laid_out(grid_champion())
    assert any((edge.source, edge.target) == ((0, -2), (0, 1)) for edge in graph.edges)
    assert layout.places[0, -2][0] == pytest.approx(layout.places[0, 1][0])
    assert abs(layout.places[0, 4][0] - layout.places[0, 1][0]) > 0.08


def test_every_node_stands_inside_the_box_of_its_module() -> None:
    for content in (grid_champion(), modular_champion()):
        graph, layout = laid_out(content)
        wanted = sum(len(module.pins) + module.outputs for module in graph.plan.modules) + sum(map(len, graph.hidden))
        assert len(layout.places) == wanted
        for (m, _), (x, y) in layout.places.items():
            box = layout.boxes[m]
            assert box.x < x < box.x + box.width
            assert box.y < y < box.y + box.height


def test_nodes_that_lead_from_no_sensor_to_an_actuator_are_unused() -> None:
    graph = champion_graph(grid_champion())
    assert graph.used == {(0, -1), (0, -2), (0, 0), (0, 1), (0, 2), (0, 3)}


def test_a_module_counts_as_used_as_far_as_others_read_it() -> None:
    graph = champion_graph(modular_champion())
    assert (LEGS["back_right"], 0) not in graph.used, "nothing reads its output"
    assert (LEGS["back_right"], 1) in graph.used, "the back left leg reads its hidden node"
    assert all((leg, 0) in graph.used for leg in range(3))


def test_a_disabled_connection_is_neither_drawn_nor_a_path() -> None:
    content = grid_champion()
    content["genomes"][0]["connections"][0]["enabled"] = False
    graph = champion_graph(content)
    assert all(edge.source != (0, -1) for edge in graph.edges)
    assert graph.used == {(0, -2), (0, 1)}


def test_links_run_between_the_modules_that_the_plan_names() -> None:
    graph = champion_graph(modular_champion())
    delayed = {(link.source, link.target) for link in graph.links if link.delayed}
    prompt = {(link.source, link.target) for link in graph.links if not link.delayed}
    # Hidden node 0 of a leg with one output is node 1; each leg's third pin reads the next leg.
    assert delayed == {(((k + 1) % 4, 1), (k, -3)) for k in range(4)}
    assert prompt == {((leg, 0), (4, -2 - leg)) for leg in range(3)}


def test_a_link_to_a_deleted_node_is_left_out() -> None:
    content = modular_champion()
    content["genomes"][0] = a_genome([0], [(-1, 0, 0.5)])
    assert not any(link.delayed for link in champion_graph(content).links)


def test_modules_that_share_a_genome_show_the_same_weights() -> None:
    graph = champion_graph(modular_champion())
    weights = [{(e.source[1], e.target[1]): e.weight for e in graph.edges if e.source[0] == leg} for leg in range(4)]
    assert (
        weights[0] == weights[1] == weights[2] == weights[3] == {(-1, 1): 0.5, (-2, 1): -0.8, (-3, 1): 0.2, (1, 0): 1.2}
    )


def test_modules_stand_on_the_page_as_on_the_body() -> None:
    _, layout = laid_out(modular_champion())
    x, y = zip(*(centre(layout, m) for m in range(5)), strict=True)
    middle_x, middle_y = x[LEGS["central"]], y[LEGS["central"]]
    assert x[LEGS["front_left"]] < middle_x < x[LEGS["front_right"]]
    assert x[LEGS["back_left"]] < middle_x < x[LEGS["back_right"]]
    assert y[LEGS["front_left"]] == y[LEGS["front_right"]] > middle_y > y[LEGS["back_left"]] == y[LEGS["back_right"]]


def test_the_parts_of_a_map_keep_its_directions() -> None:
    sides = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)}
    modules = [
        a_module(name, place, 0, pins=[a_pin("sensor", k)], outputs=1, drives=[k])
        for k, (name, place) in enumerate(sides.items())
    ]
    content = a_champion(modules, [a_genome([0], [(-1, 0, 1.0)])], list(sides), 4)
    graph, layout = laid_out(content)
    assert page_direction(graph.plan.modules) == list(sides.values())
    left, right, up, down = (centre(layout, m) for m in range(4))
    assert left[0] < up[0] == down[0] < right[0]
    assert down[1] < left[1] == right[1] < up[1]


def test_a_single_module_fills_the_page() -> None:
    _, layout = laid_out(grid_champion())
    (box,) = layout.boxes
    assert (box.x, box.y, box.width, box.height) == pytest.approx((0.0, 0.0, layout.width, layout.height))


def axes_of(graph: ChampionGraph) -> Axes:
    axes = Figure().add_subplot()
    draw_champion(axes, graph, *natural_size(graph))
    return axes


def test_colour_tells_the_sign_width_the_size_and_faintness_the_unused() -> None:
    axes = axes_of(champion_graph(grid_champion()))
    (edges,) = [each for each in axes.collections if isinstance(each, LineCollection)]
    # Lightest first: 0.3, -0.5, 1.0 (unused), -1.0, 1.5 and 2.0; the connection to itself is a loop.
    signs = [tuple(colour[:3]) for colour in edges.get_colors()]
    assert signs == [rgb(POSITIVE), rgb(NEGATIVE), rgb(POSITIVE), rgb(NEGATIVE), rgb(POSITIVE), rgb(POSITIVE)]
    widths = list(edges.get_linewidths())
    assert widths == sorted(widths)
    assert widths[0] < widths[1] < widths[4]
    assert [colour[3] == FAINT for colour in edges.get_colors()] == [False, False, True, False, False, False]
    assert len([patch for patch in axes.patches if isinstance(patch, Ellipse)]) == 1


def rgb(colour: str) -> tuple[float, ...]:
    return tuple(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))


def test_delayed_links_are_dashed_and_prompt_ones_are_not() -> None:
    axes = axes_of(champion_graph(modular_champion()))
    links = [patch for patch in axes.patches if isinstance(patch, PathPatch)]
    assert [link.get_linestyle() == "-" for link in links] == [False] * 4 + [True] * 3


def test_sensors_carry_their_index_and_outputs_the_actuators_name() -> None:
    axes = axes_of(champion_graph(modular_champion()))
    texts = [text.get_text() for text in axes.texts]
    assert {str(k) for k in range(9)} <= set(texts)
    assert texts.count("hip 1") == texts.count("ankle 1") == 1
    assert "front left  (genome 1, shared by 4)" in texts
    assert "central" in texts


def test_the_legend_speaks_of_links_and_loops_only_where_there_are_any() -> None:
    def words(content: dict[str, Any]) -> str:
        return " ".join(str(entry.get_label()) for entry in legend_entries([champion_graph(content)]))

    assert "link" not in words(grid_champion())
    assert "loop" in words(grid_champion())
    assert "one step late" in words(modular_champion())
    assert "loop" not in words(modular_champion())


def a_run(directory: Path, content: dict[str, Any]) -> RunDirectory:
    directory.mkdir(parents=True)
    run = RunDirectory(directory)
    write_json(run.champion, content)
    return run


@pytest.mark.parametrize("content", [grid_champion(), modular_champion()], ids=["grid", "modular"])
def test_the_same_champion_gives_the_same_bytes(tmp_path: Path, content: dict[str, Any]) -> None:
    written = [draw_network(a_run(tmp_path / place / "run", content)) for place in ("a", "b")]
    assert [path.name for path in written[0]] == ["network.png", "network.svg"]
    for one, other in zip(*written, strict=True):
        assert one.read_bytes() == other.read_bytes()


@pytest.mark.parametrize("content", [grid_champion(), modular_champion()], ids=["grid", "modular"])
def test_nothing_reaches_the_edge_of_the_picture(tmp_path: Path, content: dict[str, Any]) -> None:
    assert has_white_edges(draw_network(a_run(tmp_path / "run", content))[0])


def test_a_run_without_a_champion_is_named(tmp_path: Path) -> None:
    with pytest.raises(ExneatError, match="baselines and unfinished runs have no network"):
        draw_network(RunDirectory(tmp_path / "random-s0"))


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: content.pop("plan"),
        lambda content: content["genomes"].clear(),
        lambda content: content["genomes"][0]["connections"][0].update({"to": 77}),
        lambda content: content["genomes"][0]["nodes"].pop(0),
        lambda content: content["actuators"].pop(),
        lambda content: content["plan"]["modules"][0]["drives"].append(9),
    ],
    ids=["no plan", "no genome", "no such node", "no output", "no actuator", "drives too much"],
)
def test_a_damaged_champion_is_an_error_of_one_line(tmp_path: Path, damage: Any) -> None:
    content = grid_champion()
    damage(content)
    with pytest.raises(ExneatError, match=r"champion\.json: damaged") as raised:
        draw_network(a_run(tmp_path / "run", content))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(("algorithm", "linkage"), [("neat", "none"), ("exneat", "full")])
def test_the_champions_that_runs_write_can_be_drawn(tmp_path: Path, algorithm: str, linkage: str) -> None:
    task = AntTask()
    geometry = Geometry("all" if algorithm == "exneat" else "single")
    settings, evolution = ALGORITHMS[algorithm](), EvolutionSettings(neat_hidden=4)
    plan = settings.plan(task, geometry, linkage, Wiring(), evolution)
    team = settings.start(Problem(plan, evolution, 4, 1, "rank", 0)).ask().teams[0]
    scores = {"test": {"fitness_mean": 1.0, "fitness_std": 0.0, "episodes": 1}}
    run = RunDirectory(tmp_path)
    names = task.actuator_names
    write_champion(run.champion, Champion(algorithm, {}, names, True, plan, team.genomes, scores))
    graph = read_champion_graph(run)
    assert len(graph.links) == (0 if algorithm == "neat" else 4 * (3 * 2 + 3 * 4 + 8) + 4 * 2)
    assert graph.actuators == names
    dots = [each for each in axes_of(graph).collections if isinstance(each, PathCollection)]
    pins = sum(len(module.pins) for module in plan.modules)
    assert sum(len(each.get_offsets()) for each in dots) == pins + sum(m.outputs + m.hidden for m in plan.modules)

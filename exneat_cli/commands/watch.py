"""`exneat watch`: a film of champions in an episode, their networks beside them."""

from __future__ import annotations

import functools
import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.doctor import FRAME, said_by
from exneat_cli.commands.jobs import finished_runs, name_code, with_sweeps
from exneat_cli.errors import (
    ConfigError,
    ExneatError,
    check_choice,
    check_keys,
    check_real,
    check_section,
    check_text,
    check_whole,
)
from exneat_cli.records import RunDirectory
from exneat_cli.records.champion import Champion
from exneat_cli.records.video import VIDEO_FORMATS, check_video_library, write_video
from exneat_cli.rollouts import Executor, Sweep
from exneat_cli.runs import Scene, load_settings, record_champion
from exneat_cli.tasks import HasPicture, RobotTask, Task

ROBOTS_FPS, GRID_FPS = 10.0, 4.0
"""Frames a second unless told otherwise: of a robot's own time, at most one a control step; of a grid world one each"""
SHORT = 200
"""Control steps of a film that training makes."""
PORTION = 8
"""Frames that a process draws at a time."""
_KEYS = ("run", "format", "panel", "episode", "seed", "level", "steps", "fps", "width", "height", "workers", "output")


def run(line: CommandLine) -> int:
    """Film the champions of runs, side by side; returns the exit code.

    Raises:
        ExneatError: a run or a setting is unusable, or there is no renderer or no ffmpeg; nothing was written then.
    """
    plain = line.compose_only((*_KEYS, "task", "sweeps"), ("sweep",))
    _check(plain)
    name_code(line, plain)
    runs = finished_runs(plain["run"])
    form, panel, output = plain["format"], plain["panel"], plain["output"]
    if output is None and len(runs) > 1:
        raise ConfigError("output", "a file, where several runs are watched together", output, "output=ants.mp4")
    check_video_library()
    steps = 1_000_000 if plain["steps"] is None else plain["steps"]
    scenes = []
    for directory in runs:
        sweep = _sweep(plain, directory)
        scenes.append(
            record_champion(directory, episode=plain["episode"], seed=plain["seed"], sweep=sweep, steps=steps)
        )
    if any(isinstance(scene.task, RobotTask) for scene in scenes):
        choose_renderer()
    with_panels = panel == "networks" or (panel is None and len(runs) == 1)
    size = plain["width"], plain["height"]
    every, fps = _rhythm(scenes, plain["fps"])
    path = Path(output) if output is not None else runs[0].path / "plots" / f"{_stem(plain)}.{form}"
    frames = drawn(scenes, every, size, with_panels, Executor(workers=plain["workers"]).threads)
    count = write_video(path, frames, fps, form)
    print(f"Written: {path} ({count} frames, {count / fps:.1f} s)")
    return 0


def film_champion(directory: RunDirectory) -> None:
    """Film the champion of a finished run for its plots, the first `SHORT` steps, unless it was filmed before.

    Raises:
        ExneatError: there is no renderer or no ffmpeg, or the task has no pictures.
    """
    path = directory.plots / "champion.mp4"
    if path.exists():
        return
    check_video_library()
    scene = record_champion(directory, episode=0, seed=None, sweep=None, steps=SHORT)
    if isinstance(scene.task, RobotTask):
        choose_renderer()
    every, fps = _rhythm([scene], None)
    write_video(path, drawn([scene], every, (640, 480), True, Executor().threads), fps, "mp4")


def _check(plain: Mapping[str, Any]) -> None:
    check_keys("task.", check_section("task", plain["task"]), ("kind", "env_id"))
    check_choice("format", plain["format"], list(VIDEO_FORMATS))
    if plain["panel"] is not None:
        check_choice("panel", plain["panel"], ["networks", "none"])
    check_whole("episode", plain["episode"], 0, 9999)
    check_whole("workers", plain["workers"], 0, 64)
    if plain["seed"] is not None:
        check_whole("seed", plain["seed"], 0, 2**64 - 1)
    if plain["steps"] is not None:
        check_whole("steps", plain["steps"], 1, 1_000_000)
    if plain["fps"] is not None:
        check_real("fps", plain["fps"], 0.1, 200.0)
    for side in ("width", "height"):
        check_whole(side, plain[side], 64, 4096)
    if plain["output"] is not None:
        check_text("output", plain["output"], "a file")


def _sweep(plain: Mapping[str, Any], directory: RunDirectory) -> Sweep | None:
    """The sweep with the one level that is watched."""
    names, level = check_section("sweeps", plain["sweeps"]), plain["level"]
    if not names:
        if level is not None:
            raise ConfigError("level", "null without a sweep", level, "e.g. sweep=sensor_noise level=0.3")
        return None
    if len(names) > 1:
        raise ConfigError("sweep", "one sweep", list(names))
    if level is None:
        raise ConfigError("level", "a level of the sweep, e.g. 0.3", level)
    chosen = {**plain, "sweep": {"levels": [level], "episodes": 1}}
    return with_sweeps("", load_settings(directory), chosen).sweeps[0]


def _stem(plain: Mapping[str, Any]) -> str:
    """What the film is called in its run's folder: by what differs from the usual one."""
    words = ["champion", *plain["sweeps"], plain["level"] if plain["sweeps"] else None]
    words += [f"seed{plain['seed']}" if plain["seed"] is not None else None]
    words += [f"episode{plain['episode']}" if plain["episode"] else None]
    return "-".join(str(word) for word in words if word is not None)


def _rhythm(scenes: Sequence[Scene], fps: float | None) -> tuple[list[int], float]:
    """Control steps from one frame to the next of each scene, and frames a second, in real time."""
    periods = [scene.period for scene in scenes]
    if any(period is None for period in periods):
        return [1] * len(scenes), fps or GRID_FPS
    every = [max(1, round(1.0 / ((fps or ROBOTS_FPS) * period))) for period in periods if period is not None]
    return every, 1.0 / (every[0] * (periods[0] or 1.0))


def choose_renderer() -> None:
    """Set MUJOCO_GL for processes to come, unless the user did, and try it out.

    Raises:
        ExneatError: MuJoCo can draw nothing here.
    """
    given = os.environ.get("MUJOCO_GL")
    choices = [given] if given or sys.platform != "linux" else ["egl", "osmesa"]
    for choice in choices:
        try:
            said_by(["-c", FRAME], 60.0, **({"MUJOCO_GL": choice} if choice else {}))
        except ExneatError as error:
            why = str(error)
            continue
        if choice:
            os.environ["MUJOCO_GL"] = choice
        return
    fix = "apt-get install libegl1 libopengl0 libgl1-mesa-dri, and leave MUJOCO_GL unset; exneat doctor tries it"
    raise ExneatError(
        f"watch: expected a renderer for MuJoCo, got none ({', '.join(map(str, choices))}): {why}\n  {fix}"
    )


class _Look(NamedTuple):
    """How one scene looks, whatever the moment."""

    task: Task
    champion: Champion | None
    nodes: list[tuple[int, int]]
    title: str


_Moment = tuple[Any, NDArray[np.float64], str]
"""What was, the shares of nodes, and the caption."""


def drawn(
    scenes: Sequence[Scene], every: Sequence[int], size: tuple[int, int], with_panels: bool, workers: int
) -> Iterator[NDArray[np.uint8]]:
    """The frames in order, drawn by processes of their own; scenes that are over stay at their end.

    Raises:
        ExneatError: a process could not draw.
    """
    looks = [_Look(scene.task, scene.champion if with_panels else None, scene.nodes, scene.title) for scene in scenes]
    shown = [range(0, len(scene.snapshots), step) for scene, step in zip(scenes, every, strict=True)]
    moments = [
        [_moment(scene, own, k) for scene, own in zip(scenes, shown, strict=True)] for k in range(max(map(len, shown)))
    ]
    portions = [moments[k : k + PORTION] for k in range(0, len(moments), PORTION)]
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(workers, len(portions)), context, _prepare, (looks, size))
    try:
        waiting: list[Future[list[NDArray[np.uint8]]]] = []
        for portion in portions:
            waiting.append(pool.submit(_draw, portion))
            if len(waiting) > 2 * workers:  # frames are large: no more of them than are needed soon
                yield from waiting.pop(0).result()
        for each in waiting:
            yield from each.result()
    except BrokenProcessPool as error:
        raise ExneatError("watch: a process that drew frames died\n  exneat doctor tries the renderer") from error
    finally:
        pool.shutdown(cancel_futures=True)


def _moment(scene: Scene, shown: range, k: int) -> _Moment:
    t = shown[min(k, len(shown) - 1)]
    return scene.snapshots[t], scene.shares[t], scene.captions[t] + ("    ended" if k >= len(shown) else "")


_painter: Any = None


def _prepare(looks: Sequence[_Look], size: tuple[int, int]) -> None:
    """Open cameras in a process that draws."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that began it hears it
    from exneat_cli.analysis.film import BAR, Panel

    global _painter
    cameras, panels = [], []
    for look in looks:
        assert isinstance(look.task, HasPicture)
        cameras.append(look.task.camera(size[0], size[1] - 2 * BAR))
        panels.append(look.champion and Panel(look.champion, look.nodes, *size))
    _painter = functools.partial(_paint, looks, cameras, panels)


def _draw(moments: Sequence[Sequence[_Moment]]) -> list[NDArray[np.uint8]]:
    return [_painter(each) for each in moments]


def _paint(looks: Any, cameras: Any, panels: Any, moments: Sequence[_Moment]) -> NDArray[np.uint8]:
    from exneat_cli.analysis.film import Still, frame

    stills = [
        Still(camera.draw(snapshot), look.title, caption, panel and panel.draw(shares))
        for look, camera, panel, (snapshot, shares, caption) in zip(looks, cameras, panels, moments, strict=True)
    ]
    return frame(stills)

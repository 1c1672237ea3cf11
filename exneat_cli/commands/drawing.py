"""Drawing the frames of films in separate processes, the renderer that they need, and the film after training."""

from __future__ import annotations

import functools
import multiprocessing
import os
import signal
import sys
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.synchronize import Event
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.commands.doctor import FRAME, said_by
from exneat_cli.errors import ExneatError
from exneat_cli.records import RunDirectory
from exneat_cli.records.champion import Champion
from exneat_cli.records.video import check_video_library, write_video
from exneat_cli.rollouts import Executor
from exneat_cli.runs import Scene, load_settings, record_champion
from exneat_cli.tasks import HasPicture, Task

PORTION = 8
"""Frames that a process draws at a time."""
SHORT = 200
"""Control steps of the film that is made after training."""


def choose_renderer() -> None:
    """Set MUJOCO_GL for later processes, unless the user did, and try it out.

    Raises:
        ExneatError: MuJoCo cannot draw on this machine.
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
    fix = "apt-get install libegl1 libopengl0 libgl1-mesa-dri, and leave MUJOCO_GL unset; exneat doctor tests it"
    raise ExneatError(
        f"watch: expected a renderer for MuJoCo, got none ({', '.join(map(str, choices))}): {why}\n  {fix}"
    )


def film_champion(directory: RunDirectory) -> None:
    """Film the first `SHORT` steps of a finished run's champion for its plots, unless there is such a film.

    Raises:
        ExneatError: there is no renderer or no ffmpeg, or the task has no pictures.
    """
    path = directory.plots / "champion.mp4"
    if path.exists():
        return
    check_video_library()
    if load_settings(directory).task.drawn_by_mujoco:
        choose_renderer()
    scene = record_champion(directory, episode=0, seed=None, sweep=None, steps=SHORT, fps=None)
    write_video(path, drawn([scene], (640, 480), True, Executor().threads), scene.fps, "mp4")


class _Look(NamedTuple):
    """What stays the same throughout a scene."""

    task: Task
    champion: Champion | None
    nodes: list[tuple[int, int]]
    title: str


_Moment = tuple[Any, NDArray[np.float64], str]
"""The snapshot of the world, the shares of the nodes, and the caption."""


def drawn(
    scenes: Sequence[Scene], size: tuple[int, int], with_panels: bool, workers: int
) -> Generator[NDArray[np.uint8]]:
    """Yield the frames in order, drawn by separate processes; scenes that are over show their end.

    Raises:
        ExneatError: a process could not draw.
    """
    looks = [_Look(scene.task, scene.champion if with_panels else None, scene.nodes, scene.title) for scene in scenes]
    moments = [[_moment(scene, k) for scene in scenes] for k in range(frames_of(scenes))]
    portions = [moments[k : k + PORTION] for k in range(0, len(moments), PORTION)]
    context = multiprocessing.get_context("spawn")
    over = context.Event()
    pool = ProcessPoolExecutor(min(workers, len(portions)), context, _prepare, (looks, size, over))
    try:
        waiting: list[Future[list[NDArray[np.uint8]]]] = []
        for portion in portions:
            waiting.append(pool.submit(_draw, portion))
            if len(waiting) > 2 * workers:  # frames are large: keep only those needed soon
                yield from waiting.pop(0).result()
        for each in waiting:
            yield from each.result()
    except BrokenProcessPool as error:
        raise ExneatError("watch: a process that draws frames died\n  exneat doctor tests the renderer") from error
    finally:
        over.set()
        pool.shutdown(cancel_futures=True)


def frames_of(scenes: Sequence[Scene]) -> int:
    """The number of frames of the longest scene."""
    return max(len(scene.snapshots) for scene in scenes)


def _moment(scene: Scene, k: int) -> _Moment:
    last = len(scene.snapshots) - 1
    t = min(k, last)
    return scene.snapshots[t], scene.shares[t], scene.captions[t] + ("    ended" if k > last else "")


_painter: Any = None
_over: Any = None


def _prepare(looks: Sequence[_Look], size: tuple[int, int], over: Event) -> None:
    """Open the cameras of a process, which draws until `over` is set."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles it
    from exneat_cli.analysis.film import BAR, Panel

    global _painter, _over
    cameras, panels, room = [], [], (size[0], size[1] - 2 * BAR)
    for look in looks:
        assert isinstance(look.task, HasPicture)
        cameras.append(look.task.camera(*room))
        panels.append(look.champion and Panel(look.champion, look.nodes, *size))
    _painter, _over = functools.partial(_paint, looks, cameras, panels, room), over


def _draw(moments: Sequence[Sequence[_Moment]]) -> list[NDArray[np.uint8]]:
    return [_painter(each) for each in moments if not _over.is_set()]


def _paint(
    looks: Any, cameras: Any, panels: Any, room: tuple[int, int], moments: Sequence[_Moment]
) -> NDArray[np.uint8]:
    from exneat_cli.analysis.film import Still, fitted, frame

    stills = [
        Still(fitted(camera.draw(snapshot), *room), look.title, caption, panel and panel.draw(shares))
        for look, camera, panel, (snapshot, shares, caption) in zip(looks, cameras, panels, moments, strict=True)
    ]
    return frame(stills)

"""`exneat watch`: films champions in an episode, next to their networks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from exneat_cli.commands.command_line import CommandLine
from exneat_cli.commands.drawing import choose_renderer, drawn, frames_of
from exneat_cli.commands.jobs import finished_runs, name_code_of_runs, with_sweeps
from exneat_cli.commands.live import show
from exneat_cli.errors import ConfigError, check_choice, check_flag, check_path, check_real, check_section, check_whole
from exneat_cli.records import RunDirectory
from exneat_cli.records.video import VIDEO_FORMATS, check_video_library, write_video
from exneat_cli.rollouts import Executor, Sweep
from exneat_cli.runs import load_settings, record_champion

_KEYS = (
    *("run", "format", "panel", "episode", "seed", "level", "steps", "fps", "width", "height", "workers", "output"),
    *("live", "port"),
)


def run(line: CommandLine) -> int:
    """Film the champions of runs, side by side, or show them in the browser; returns the exit code.

    Raises:
        ExneatError: a run or a setting is unusable, or there is no renderer or no ffmpeg; nothing is written then.
    """
    plain = line.compose_only((*_KEYS, "task", "sweeps"), ("sweep",))
    _check(plain)
    name_code_of_runs(line, plain)
    runs = finished_runs(plain["run"])
    form, output = plain["format"], plain["output"]
    if not plain["live"]:
        if output is None and len(runs) > 1:
            raise ConfigError("output", "a file, since several runs are watched together", output, "output=ants.mp4")
        check_video_library()
    if any(load_settings(directory).task.drawn_by_mujoco for directory in runs):
        choose_renderer()
    options = {key: plain[key] for key in ("episode", "seed", "fps")}
    options["steps"] = 1_000_000 if plain["steps"] is None else plain["steps"]
    scenes = [record_champion(directory, sweep=_sweep(plain, directory), **options) for directory in runs]
    with_panels = plain["panel"] == "networks" or (plain["panel"] is None and len(runs) == 1)
    size = plain["width"], plain["height"]
    frames = drawn(scenes, size, with_panels, Executor(workers=plain["workers"]).threads)
    fps = scenes[0].fps
    if plain["live"]:
        show(frames, frames_of(scenes), fps, plain["port"])
        return 0
    beside = runs[0].path / "plots" / f"{_stem(plain)}.{form}"
    path = beside if output is None else check_path("output", output, "a file")
    count = write_video(path, frames, fps, form)
    print(f"Written: {path} ({count} frames, {count / fps:.1f} s)")
    return 0


def _check(plain: Mapping[str, Any]) -> None:
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
        check_path("output", plain["output"], "a file")
    check_flag("live", plain["live"])
    check_whole("port", plain["port"], 0, 65535)
    if plain["live"] and plain["output"] is not None:
        raise ConfigError("output", "null with live=true, which writes no file", plain["output"])


def _sweep(plain: Mapping[str, Any], directory: RunDirectory) -> Sweep | None:
    """The sweep, with the one level to watch."""
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
    """The name of the film in its run's folder, made of what differs from the default film."""
    words = ["champion", *plain["sweeps"], plain["level"] if plain["sweeps"] else None]
    words += [f"seed{plain['seed']}" if plain["seed"] is not None else None]
    words += [f"episode{plain['episode']}" if plain["episode"] else None]
    return "-".join(str(word) for word in words if word is not None)

"""`exneat watch`: films that can be decoded, and refusals that leave nothing."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pytest
from PIL import Image

import exneat_cli
from exneat_cli.analysis.film import fitted
from exneat_cli.commands import drawing, watch
from exneat_cli.errors import ExneatError
from exneat_cli.main import main
from exneat_cli.records import RunDirectory
from exneat_cli.records.video import VIDEO_FORMATS
from exneat_cli.runs import Scene, record_champion
from tests.commands.figures import without_figures
from tests.commands.refusals import check_refusal

FFMPEG = "pip install 'exneat[video]'"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("outputs")
    with without_figures():
        for settings in (
            ["task=foraging", "task.steps=9"],
            ["task=foraging", "task.steps=9", "seed=1"],
            ["task=foraging", "algorithm=random"],
            ["task=ant", "task.max_steps=12"],
        ):
            assert main(["train", "budget=smoke", *settings, f"output={output}"]) == 0
    return output


def run_of(runs: Path, pattern: str) -> Path:
    return next(iter(sorted(runs.glob(pattern))))


def decoded(path: Path) -> list[np.ndarray]:
    """The frames of a film."""
    if path.suffix == ".mp4":
        ffmpeg = pytest.importorskip("imageio_ffmpeg", reason=FFMPEG)
        raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
        done = subprocess.run([ffmpeg.get_ffmpeg_exe(), "-i", path, *raw], check=True, capture_output=True)
        width, height = re.search(rb"Video: .* (\d+)x(\d+)", done.stderr).groups()  # type: ignore[union-attr]
        return list(np.frombuffer(done.stdout, np.uint8).reshape(-1, int(height), int(width), 3))
    with Image.open(path) as film:
        found = []
        for k in range(film.n_frames):
            film.seek(k)
            found.append(np.asarray(film.convert("RGB")))
        return found


def brown(picture: np.ndarray) -> tuple[np.ndarray, ...]:
    """Rows and columns of the pixels that are the Ant's."""
    red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
    return np.nonzero((red > green + 20) & (green > blue))


@pytest.mark.parametrize("form", ["mp4", "gif", "webp"])
def test_a_grid_world_plays_in_every_format(form: str, runs: Path) -> None:
    pytest.importorskip("imageio_ffmpeg", reason=FFMPEG)
    run = run_of(runs, "foraging/exneat-*-s0-*")
    assert main(["watch", f"run={run}", f"format={form}", "workers=1", "width=320", "height=240"]) == 0
    frames = decoded(run / "plots" / f"champion.{form}")
    assert len(frames) == 10, "what was before each of 9 steps, and what the last one led to"
    assert frames[0].shape == (240, 640, 3)
    middle = frames[4].astype(int)
    assert (np.abs(middle[:, :320] - (0, 153, 51)).max(axis=-1) < 60).sum() > 100, "no agent"
    assert np.abs(frames[0].astype(int) - frames[-1]).mean() > 0.5, "nothing moves"
    assert [path.name for path in (run / "plots").iterdir() if path.name.startswith(".")] == []


def test_runs_stand_side_by_side_without_panels_and_under_noise(
    runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    pytest.importorskip("imageio_ffmpeg", reason=FFMPEG)
    noisy = ["sweep=sensor_noise", "level=0.3", "episode=2", "workers=1", "width=160", "height=120"]
    path = tmp_path / "new" / "both.gif"
    assert main(["watch", f"run={runs}/foraging/exneat-*", *noisy, "output='~/new/both.gif'", "format=gif"]) == 0
    assert {frame.shape for frame in decoded(path)} == {(120, 320, 3)}
    run = run_of(runs, "foraging/exneat-*-s0-*")
    assert main(["watch", f"run={run}", *noisy, "panel=none", "format=gif"]) == 0
    assert (run / "plots" / "champion-sensor_noise-0.3-episode2.gif").exists()


def test_a_robot_is_in_view_and_its_nodes_light_up(runs: Path) -> None:
    pytest.importorskip("imageio_ffmpeg", reason=FFMPEG)
    try:
        drawing.choose_renderer()
    except ExneatError as error:
        pytest.skip(str(error))
    run = run_of(runs, "ant/*")
    assert main(["watch", f"run={run}", "workers=1"]) == 0
    frames = decoded(run / "plots" / "champion.mp4")
    assert len(frames) == 6, "every second step of 12"
    assert frames[0].shape == (480, 1280, 3)
    rows, columns = brown(frames[3][24:-24, :640])
    assert len(rows) > 2000
    assert abs(rows.mean() - 216) < 100, "the body is not in the middle"
    assert abs(columns.mean() - 320) < 150
    assert (frames[1][:, 640:] != frames[4][:, 640:]).any()
    scene = record_champion(RunDirectory(run), episode=0, seed=None, sweep=None, steps=1, fps=None)
    pose = scene.snapshots[0] + 3.0 * (np.arange(len(scene.snapshots[0])) == 2)
    (high,) = drawing.drawn([replace(scene, snapshots=[pose])], (640, 480), False, 1)
    assert len(brown(high[24:-24])[0]) > 2000, "the camera stays below a body that jumps"


def test_training_films_its_champion_once_if_asked_to_and_does_without_where_it_cannot(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    train = ["train", "task=track_maze", "budget=smoke", "video=true", f"output={tmp_path}"]
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "imageio_ffmpeg", None)
        assert main(train) == 0
    said = capfd.readouterr().err
    assert said.count("no video: expected ffmpeg") == 1
    assert FFMPEG in said
    pytest.importorskip("imageio_ffmpeg", reason=FFMPEG)
    assert main(train) == 0
    (film,) = tmp_path.glob("track_maze/*/plots/champion.mp4")
    made = film.stat().st_mtime_ns
    assert len(decoded(film)) > 1
    assert main(train) == 0
    assert film.stat().st_mtime_ns == made
    assert main([*train, "algorithm=random"]) == 0
    check_refusal([*train, "video=1"], ["video: expected true or false"], tmp_path, capfd)


FAULTY = {
    "an unknown codec": "-c:v nonsense",
    "a disk that fills up once frames were taken": "-c:v libx264 -pix_fmt yuv420p -f mp4 /dev/full",
}


@pytest.mark.parametrize("fault", FAULTY)
def test_a_film_that_ffmpeg_cannot_finish_leaves_what_was_there(
    fault: str, runs: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("imageio_ffmpeg", reason=FFMPEG)
    before = tmp_path / "film.mp4"
    before.write_bytes(b"before")
    monkeypatch.setitem(VIDEO_FORMATS, "mp4", FAULTY[fault].split())
    run = run_of(runs, "foraging/exneat-*-s0-*")
    arguments = ["watch", f"run={run}", "workers=1", "width=64", "height=64", f"output={before}"]
    check_refusal(arguments, ["film.mp4: could not be written: ffmpeg says"], tmp_path, capfd)


def test_a_picture_of_any_shape_fits_in_without_being_stretched() -> None:
    picture = fitted(np.full((20, 80, 3), (200, 0, 0), np.uint8), 160, 120)
    rows, columns = np.nonzero((picture == (200, 0, 0)).all(axis=-1))
    assert picture.shape == (120, 160, 3)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (40, 79, 0, 159)


def leave(port: int, asked: bytes) -> None:
    """Ask, and be gone before the answer, as a closed tab is."""
    with socket.create_connection(("127.0.0.1", port)) as browser:
        browser.sendall(asked)
        browser.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def test_a_page_of_this_machine_shows_the_frames_until_it_is_interrupted(runs: Path) -> None:
    run = run_of(runs, "foraging/exneat-*-s0-*")
    script = "import sys\nfrom exneat_cli.main import main\nif __name__ == '__main__': sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", script, "watch", f"run={run}", "live=true", "width=160", "height=120"]
    environment = {**os.environ, "PYTHONPATH": str(Path(exneat_cli.__file__).parents[1])}
    pipe = subprocess.PIPE
    with subprocess.Popen([*command, "workers=1"], stdout=pipe, stderr=pipe, env=environment, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            address = process.stdout.readline().split()[0]
            assert address.startswith("http://127.0.0.1:")
            with urlopen(address) as page:
                text = page.read().decode()
            assert "last = 9" in text
            assert not re.findall(r"(?:src|href)=.?(?:https?:)?//", text), "it would ask the network"
            with urlopen(f"{address}/frames/9.jpg") as frame, Image.open(frame) as picture:
                assert picture.size == (320, 120)
            for absent in ("frames/10.jpg", "frames/-1.jpg", "frames/../../etc/passwd", f"frames/{'9' * 5000}.jpg"):
                with pytest.raises(HTTPError, match="404"):
                    urlopen(f"{address}/{absent}")
            port = int(address.rpartition(":")[2])
            for asked in (b"GET", b"GET /frames/0.jpg HTTP/1.0\r\n\r\n"):
                leave(port, asked)
            assert main(["watch", f"run={run}", "live=true", f"port={port}", "steps=1", "workers=1"]) == 2
        finally:
            process.send_signal(signal.SIGINT)
        assert (process.stdout.read(), process.stderr.read()) == ("exneat: the page was closed\n", "")
    assert process.returncode == 0


class Slow:
    """A task whose camera notes what it draws, and waits at the tenth picture for a file."""

    def __init__(self, place: Path) -> None:
        self._place = place

    def snapshot(self, world: Any) -> Any:
        return world

    def camera(self, width: int, height: int) -> Slow:
        return self

    def draw(self, snapshot: int) -> np.ndarray:
        (self._place / str(snapshot)).touch()
        while snapshot == 9 and not (self._place / "go on").exists():
            time.sleep(0.01)
        return np.zeros((18, 64, 3), np.uint8)


def test_a_film_that_is_interrupted_draws_no_more_than_the_frame_at_hand(tmp_path: Path) -> None:
    count = 5 * drawing.PORTION
    scene = Scene(Slow(tmp_path), None, "slow", [], list(range(count)), np.zeros((count, 0)), [""] * count, 4.0)  # type: ignore[arg-type]
    frames = drawing.drawn([scene], (64, 64), False, 1)
    next(frames)
    while not (tmp_path / "9").exists():
        time.sleep(0.01)
    threading.Timer(0.5, (tmp_path / "go on").touch).start()
    frames.close()
    assert {path.name for path in tmp_path.iterdir()} == {*map(str, range(10)), "go on"}


BAD = {
    "format=avi": "format: expected one of mp4, gif, webp, got 'avi'",
    "panel=all": "panel: expected one of networks, none",
    "episode=-1": "episode: expected a whole number",
    "seed=x": "seed: expected a whole number",
    "level=0.3": "level: expected null without a sweep",
    "sweep=sensor_noise": "level: expected a level of the sweep",
    "sweep=reset_noise level=0.1": "sweep: expected a sweep that fits task=foraging",
    "sweep=sensor_noise level=-1": "noise.sensor_std",
    "sweep=[p_e,p_c] level=0.1": "sweep: expected one sweep",
    "width=10": "width: expected a whole number from 64 to 4096",
    "steps=0": "steps: expected a whole number",
    "fps=0": "fps: expected a number",
    "live=1": "live: expected true or false",
    "port=70000": "port: expected a whole number from 0 to 65535",
    "live=true output=x.mp4": "output: expected null with live=true",
    "workers=99": "workers: expected a whole number",
    "foo=1": "foo: unknown key",
    "output=/proc/self/no/film.mp4": "/proc/self/no",
}


@pytest.mark.parametrize("given", BAD)
def test_what_makes_no_sense_is_refused(given: str, runs: Path, capfd: pytest.CaptureFixture[str]) -> None:
    if "output" in given:
        pytest.importorskip("imageio_ffmpeg", reason=FFMPEG)
    run = run_of(runs, "foraging/exneat-*-s0-*")
    arguments = ["watch", f"run={run}", "width=64", "height=64", "workers=1", *given.split()]
    check_refusal(arguments, [BAD[given]], runs, capfd)


def test_what_cannot_be_filmed_is_refused(
    runs: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    one = run_of(runs, "foraging/exneat-*-s0-*")
    check_refusal(["watch", f"run={one}"], ["expected ffmpeg", FFMPEG], runs, capfd)
    monkeypatch.setattr(watch, "check_video_library", lambda: None)
    old = tmp_path / "old" / one.name
    shutil.copytree(one, old)
    (old / "champion.json").write_text((old / "champion.json").read_text().replace('"format": 3', '"format": 2'))
    for arguments, named in {
        f"run={run_of(runs, 'foraging/random-*')}": "has no champion: random is a baseline",
        f"run={old}": "expected format 3, got 2: another version of exneat",
        f"run={runs}/foraging/exneat-*": "output: expected a file, since several runs",
    }.items():
        check_refusal(["watch", *arguments.split()], [named], runs, capfd)

    def failing(*arguments: Any, **environment: str) -> str:
        raise ExneatError("no library")

    monkeypatch.setattr(drawing, "said_by", failing)
    named = ["expected a renderer for MuJoCo, got none", "apt-get install libegl1"]
    check_refusal(["watch", f"run={run_of(runs, 'ant/*')}"], named, runs, capfd)

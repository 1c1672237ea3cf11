"""Writing films to files with ffmpeg, which imageio-ffmpeg provides."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Generator
from contextlib import closing, suppress
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import make_directory, replacing

_PALETTE = "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=none:diff_mode=rectangle"
VIDEO_FORMATS: dict[str, list[str]] = {
    "mp4": ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "23", "-movflags", "+faststart"],
    "gif": ["-c:v", "gif", "-vf", _PALETTE],
    "webp": ["-c:v", "libwebp_anim", "-loop", "0", "-quality", "70"],
}
"""How ffmpeg encodes each format."""


def check_video_library() -> None:
    """Refuse to begin without ffmpeg.

    Raises:
        ExneatError: imageio-ffmpeg or its ffmpeg is missing.
    """
    _ffmpeg()


def _ffmpeg() -> str:
    """The path of the program."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise ExneatError(f"expected ffmpeg (imageio-ffmpeg), got: {error}\n  pip install 'exneat[video]'") from error


def write_video(path: Path, frames: Generator[NDArray[np.uint8]], fps: float, form: str) -> int:
    """Write frames, (height, width, 3) each, in a format of `VIDEO_FORMATS`; returns how many there were.

    Raises:
        ExneatError: ffmpeg is missing or failed, or the file cannot be written; an older file is kept then.
    """
    program = _ffmpeg()
    make_directory(path.parent)
    try:
        with replacing(path) as temporary, closing(frames):
            temporary.touch()  # fails before anything is drawn
            return _encode(program, frames, fps, form, temporary)
    except _EncodingError as error:
        fix = "check the disk, or pip install --force-reinstall imageio-ffmpeg"
        raise ExneatError(f"{path}: could not be written: ffmpeg says: {error}\n  {fix}") from error


class _EncodingError(Exception):
    """What ffmpeg said when it failed."""


def _encode(program: str, frames: Generator[NDArray[np.uint8]], fps: float, form: str, path: Path) -> int:
    """Pipe frames, at least one, through ffmpeg into a file; returns how many there were."""
    first = next(frames)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{fps:g}", "-i", "pipe:0"]
    command = [program, "-loglevel", "error", "-y", *raw, *VIDEO_FORMATS[form], "-f", form, str(path)]
    count = 0
    with tempfile.TemporaryFile() as said:
        # A session of its own: on Ctrl-C, ffmpeg would finish half a film as if it were whole.
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=said, stderr=said, start_new_session=True)
        assert process.stdin is not None
        try:
            for frame in chain([first], frames):
                process.stdin.write(np.ascontiguousarray(frame).data)
                count += 1
            process.stdin.close()
        except BrokenPipeError:
            pass  # it has ended, and said why
        except BaseException:
            process.kill()
            raise
        finally:
            code = process.wait()
            with suppress(BrokenPipeError):
                process.stdin.close()
        if code or not path.stat().st_size:
            said.seek(0)
            lines = said.read().decode(errors="replace").strip().splitlines() or [f"exit code {code}"]
            raise _EncodingError(lines[-1][:200])
    return count

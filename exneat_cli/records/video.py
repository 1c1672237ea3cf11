"""Films as files, by ffmpeg, which imageio-ffmpeg brings along."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exneat_cli.errors import ExneatError
from exneat_cli.records.files import delete, make_directory

_PALETTE = "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:diff_mode=rectangle"
VIDEO_FORMATS: dict[str, dict[str, Any]] = {
    "mp4": {"codec": "libx264", "output_params": ["-crf", "23", "-movflags", "+faststart"]},
    "gif": {"codec": "gif", "pix_fmt_out": "rgb8", "output_params": ["-vf", _PALETTE, "-pix_fmt", "pal8"]},
    "webp": {"codec": "libwebp_anim", "output_params": ["-loop", "0", "-quality", "70"]},
}
"""How ffmpeg encodes each format."""


def check_video_library() -> None:
    """Refuse to begin without ffmpeg.

    Raises:
        ExneatError: imageio-ffmpeg or its ffmpeg is not there.
    """
    _ffmpeg()


def _ffmpeg() -> Any:
    try:
        import imageio_ffmpeg

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise ExneatError(f"expected ffmpeg by imageio-ffmpeg, got: {error}\n  pip install 'exneat[video]'") from error
    return imageio_ffmpeg


def write_video(path: Path, frames: Iterator[NDArray[np.uint8]], fps: float, form: str) -> int:
    """Write frames, (height, width, 3) each, of a format in `VIDEO_FORMATS`; returns how many there were.

    Raises:
        ExneatError: ffmpeg is not there, or the file cannot be written; what was there before stays.
    """
    library, count = _ffmpeg(), 0
    make_directory(path.parent)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    writer = None
    try:
        temporary.touch()
        for picture in frames:
            if writer is None:
                size = picture.shape[1], picture.shape[0]
                options = {"fps": fps, "macro_block_size": 2, "ffmpeg_log_level": "quiet", **VIDEO_FORMATS[form]}
                options["output_params"] = [*options["output_params"], "-f", form]
                writer = library.write_frames(str(temporary), size, **options)
                writer.send(None)
            writer.send(np.ascontiguousarray(picture))
            count += 1
        if writer is not None:
            writer.close()
            writer = None
        if not temporary.stat().st_size:
            raise OSError(None, "ffmpeg wrote nothing")
        temporary.replace(path)
    except OSError as error:
        why = error.strerror or " ".join(str(error).split())[:200]
        raise ExneatError(f"{path}: could not be written: {why}; check the disk and output=") from error
    finally:
        if writer is not None:
            writer.close()
        delete(temporary)
    return count

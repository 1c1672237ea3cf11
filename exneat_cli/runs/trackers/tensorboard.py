"""TensorBoard: ``tensorboard --logdir outputs`` shows runs that have ``tracker=tensorboard``.

Its numbers have 32 bits. When a run is resumed, its files are written anew from history.csv, so that no step is there
twice, or half, left by a killed process.
"""

from __future__ import annotations

import shutil
import struct
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tensorboard.compat.proto.event_pb2 import Event
from tensorboard.compat.proto.summary_pb2 import Summary, SummaryMetadata
from tensorboard.compat.proto.tensor_pb2 import TensorProto
from tensorboard.compat.proto.tensor_shape_pb2 import TensorShapeProto
from tensorboard.compat.proto.types_pb2 import DT_STRING
from tensorboard.summary.writer.event_file_writer import EventFileWriter

from exneat_cli.records import HistoryRow, RunDirectory, as_yaml

_SECONDS = 5  # between writes of rows to the disk
_WIDTH_AND_HEIGHT = slice(16, 24)  # of a PNG: https://www.w3.org/TR/png-3/#11IHDR


class OneRun:
    """The event file of a run in ``<run>/tensorboard``."""

    def __init__(self, run: RunDirectory, settings: Mapping[str, Any], history: Sequence[HistoryRow]) -> None:
        place = run.path / "tensorboard"
        shutil.rmtree(place, ignore_errors=True)
        self._writer = EventFileWriter(str(place), flush_secs=_SECONDS)
        self._step = 0
        shown = TensorProto(
            dtype=DT_STRING,
            string_val=["".join(f"    {line}\n" for line in as_yaml(dict(settings)).splitlines()).encode()],
            tensor_shape=TensorShapeProto(dim=[TensorShapeProto.Dim(size=1)]),
        )
        of_text = SummaryMetadata(plugin_data=SummaryMetadata.PluginData(plugin_name="text"))
        self._add(Summary.Value(tag="settings", tensor=shown, metadata=of_text))
        for row in history:
            self.generation(row)

    def generation(self, row: HistoryRow) -> None:
        """Add a row as scalars."""
        self._step = int(row["generation"])
        self._add(*(Summary.Value(tag=name, simple_value=value) for name, value in row.items() if name != "generation"))

    def result(self, figures: Mapping[str, float]) -> None:
        """Add the result as scalars below ``result/``."""
        self._add(*(Summary.Value(tag=f"result/{name}", simple_value=value) for name, value in figures.items()))
        self._writer.flush()

    def pictures(self, paths: Sequence[Path]) -> None:
        """Add figures; TensorBoard takes no films."""
        for path in paths:
            if path.suffix == ".png":
                data = path.read_bytes()
                width, height = struct.unpack(">II", data[_WIDTH_AND_HEIGHT])
                picture = Summary.Image(encoded_image_string=data, width=width, height=height, colorspace=4)
                self._add(Summary.Value(tag=f"figures/{path.stem}", image=picture))

    def close(self) -> None:
        """Close the file."""
        self._writer.close()

    def _add(self, *values: Summary.Value) -> None:
        self._writer.add_event(Event(step=self._step, wall_time=time.time(), summary=Summary(value=values)))

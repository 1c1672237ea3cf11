"""Reading the CSV files of a run, which somebody may have edited."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from exneat_cli.errors import ExneatError

_WORDS = ("variant", "parameter")


def read_csv(path: Path, columns: Sequence[str] = ()) -> pd.DataFrame:
    """The table in a file.

    Args:
        path: of the file.
        columns: that it must have; all but ``variant`` and ``parameter`` must hold numbers.

    Raises:
        ExneatError: the file is missing or damaged.
    """
    try:
        table = pd.read_csv(path)
    except OSError as error:
        raise ExneatError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ExneatError(f"{path}: damaged: {str(error).strip().splitlines()[-1]}") from error
    for column in columns:
        if column not in table:
            raise ExneatError(f"{path}: damaged: expected a column {column}, got {', '.join(table.columns[:5])} ...")
        if column not in _WORDS and not pd.api.types.is_numeric_dtype(table[column]):
            raise ExneatError(f"{path}: damaged: expected numbers in column {column}")
    return table

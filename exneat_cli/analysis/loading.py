"""Loading matplotlib whatever the user has set: figures are drawn without windows, see `exneat_cli.analysis.styles`."""

from __future__ import annotations

import contextlib
import os

from exneat_cli.errors import ExneatError

_chosen = os.environ.pop("MPLBACKEND", None)
try:
    import matplotlib
except (ValueError, OSError) as error:
    fix = "python -c 'import matplotlib' does the same; move away the matplotlibrc that it reads"
    raise ExneatError(f"matplotlib cannot be loaded: {error}\n  {fix}") from error
finally:
    if _chosen is not None:
        os.environ["MPLBACKEND"] = _chosen
if _chosen:
    with contextlib.suppress(ValueError):  # a backend that only another environment has, such as a notebook's
        matplotlib.rcParams["backend"] = _chosen

"""The compile cache and the copies of the episode template."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from exneat_cli.compiling import cache_directory, compiled, compiled_lean, with_functions


def double(x: float) -> float:
    return 2.0 * x


def negate(x: float) -> float:
    return -x


def template(x: float) -> float:
    return inner(x) + 1.0  # type: ignore[name-defined,no-any-return]  # noqa: F821


def test_copies_of_a_template_call_the_functions_they_were_given() -> None:
    doubling = compiled(with_functions(template, "doubling", inner=compiled(double)))
    negating = compiled(with_functions(template, "negating", inner=compiled(negate)))
    assert (doubling(3.0), negating(3.0)) == (7.0, -2.0)
    assert with_functions(template, "plain", inner=double)(3.0) == 7.0


def halve_all(values: np.ndarray) -> float:
    total = 0.0
    for i in range(values.size):
        values[i] /= 2.0
        total += values[i]
    return total


def test_lean_code_does_what_it_does_elsewhere_and_may_be_called_from_anywhere() -> None:
    plain, lean, inside = (np.arange(4.0) for _ in range(3))
    halve = compiled_lean(halve_all)
    assert halve_all(plain) == halve(lean) == compiled(with_functions(template, "halving", inner=halve))(inside) - 1.0
    np.testing.assert_array_equal(lean, plain)
    np.testing.assert_array_equal(inside, plain)


def test_lean_code_that_allocates_is_refused_by_the_compiler() -> None:
    with pytest.raises(numba.errors.NumbaError):
        compiled_lean(lambda size: np.zeros(size))(3)


def in_new_process(code: str, cache: Path) -> str:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    return done.stdout.strip()


def test_a_second_process_finds_compiled_code_in_the_cache(tmp_path: Path) -> None:
    code = (
        "import numpy as np\n"
        "from exneat_cli.brains.brain import activate, lay_out, memory_size\n"
        "from exneat_cli.brains import motionless\n"
        "brains = lay_out([motionless(3, np.zeros(2))])\n"
        "activate(brains, 0, np.zeros(memory_size(brains)), np.zeros(2))\n"
        "print(sum(activate.stats.cache_hits.values()), sum(activate.stats.cache_misses.values()))"
    )
    assert in_new_process(code, tmp_path) == "0 1"
    assert in_new_process(code, tmp_path) == "1 0"


def test_an_unusable_cache_directory_means_no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(blocked))
    cache_directory.cache_clear()
    try:
        assert cache_directory() is None
        assert compiled(double)(4.0) == 8.0
    finally:
        cache_directory.cache_clear()


def test_a_full_disk_under_the_cache_costs_only_the_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **options: object) -> object:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("tempfile.TemporaryFile", full)
        doubling = compiled(double)
    assert doubling(3.0) == 6.0

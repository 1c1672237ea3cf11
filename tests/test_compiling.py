"""The compile cache and the copies of the episode template."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from exneat_cli.compiling import _tell_damage, cache_directory, compiled, compiled_lean, with_functions
from exneat_cli.tasks.grid.maze import measure_distances


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


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache of this test's own."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(numba.core.config, "CACHE_DIR", numba.core.config.CACHE_DIR)
    cache_directory.cache_clear()
    _tell_damage.cache_clear()
    yield tmp_path
    cache_directory.cache_clear()


def measure() -> str:
    """Compile a function of the package anew and use it: hits and misses of the cache, or why there is none."""
    compiled_here: Any = compiled(measure_distances.py_func)  # type: ignore[attr-defined]
    distances = np.zeros((5, 5), np.int64)
    assert compiled_here(np.eye(5, dtype=np.int64), (1, 1), distances) == 0
    stats = compiled_here.stats
    return f"{sum(stats.cache_hits.values())} {sum(stats.cache_misses.values())}" if stats.cache_path else "uncached"


@pytest.mark.parametrize("damaged", ["nothing", "*.nbi", "*.nbc"])
def test_compiled_code_is_found_again_and_a_damaged_file_is_replaced_and_told_once(
    cache: Path, damaged: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert measure() == "0 1"
    assert measure() == "1 0"
    for length in (0, 20):
        for file in cache.rglob(damaged):
            file.write_bytes(file.read_bytes()[:length])
            assert measure() == "0 1"
            assert measure() == "1 0"
    assert capsys.readouterr().err.count("is damaged: compiling anew\n") == (damaged != "nothing")


@pytest.mark.usefixtures("cache")
@pytest.mark.parametrize("place", ["tempfile.TemporaryFile", "numba.core.caching.IndexDataCacheFile._open_for_write"])
def test_a_full_disk_under_the_cache_costs_only_the_cache(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **options: object) -> object:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(place, full)
        assert measure() in ("uncached", "0 1")
    assert measure() == "0 1"


def test_an_unusable_cache_directory_means_no_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (cache / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(cache / "file"))
    assert cache_directory() is None
    assert measure() == "uncached"


@pytest.mark.usefixtures("cache")
def test_code_that_calls_code_from_elsewhere_is_compiled_anew_in_each_process() -> None:
    # The cache would find it by its name, whatever became of the other code since.
    def cached(**functions: Any) -> bool:
        copy = with_functions(template, "copy", **functions)
        copy.__module__ = "exneat_cli.rollouts.episode"
        compiled_copy: Any = compiled(copy)
        return compiled_copy.stats.cache_path is not None

    foreign = with_functions(template, "foreign", inner=compiled(double))
    foreign.__module__ = "exneat_cli.rollouts.episode"
    assert cached(inner=measure_distances)
    assert not cached(inner=compiled(double))
    assert not cached(inner=compiled(foreign))

"""Errors that users read."""

from __future__ import annotations

import ctypes.util
import math
import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import exneat_cli
from exneat_cli.errors import ConfigError, check_choice, check_flag, check_real, check_whole


def test_a_config_error_names_key_expectation_value_and_fix() -> None:
    error = ConfigError("noise.sensor_std", "a number", "x", "set it to 0")
    assert str(error) == "noise.sensor_std: expected a number, got 'x'\n  set it to 0"


def test_a_config_error_survives_the_trip_from_another_process() -> None:
    error = pickle.loads(pickle.dumps(ConfigError("seed", "a number", 3, "fix")))
    assert str(error) == "seed: expected a number, got 3\n  fix"


@pytest.mark.parametrize("value", [True, 1.0, "1", None, -1, 11])
def test_check_whole_refuses(value: object) -> None:
    with pytest.raises(ConfigError, match="key: expected a whole number from 0 to 10"):
        check_whole("key", value, 0, 10)


@pytest.mark.parametrize("value", [True, "1", None, -0.1, 1.1, math.nan, math.inf, -math.inf])
def test_check_real_refuses(value: object) -> None:
    with pytest.raises(ConfigError, match="key: expected a number from 0 to 1"):
        check_real("key", value, 0.0, 1.0)


@pytest.mark.parametrize("value", [0, 1, "true", None])
def test_check_flag_refuses(value: object) -> None:
    with pytest.raises(ConfigError, match="key: expected true or false"):
        check_flag("key", value)


@pytest.mark.parametrize("value", ["c", None, 1, ["a"]])
def test_check_choice_refuses(value: object) -> None:
    with pytest.raises(ConfigError, match="key: expected one of a, b"):
        check_choice("key", value, ("a", "b"))


def test_bounds_themselves_are_accepted() -> None:
    check_whole("key", 0, 0, 10)
    check_whole("key", 10, 0, 10)
    check_real("key", 0, 0.0, 1.0)
    check_real("key", 1.0, 0.0, 1.0)


@pytest.mark.parametrize("setting", ["MUJOCO_GL=nonsense", "MUJOCO_GL=osmesa", "NUMBA_DISABLE_JIT=1"])
def test_an_environment_variable_that_does_not_fit_is_named_in_a_line(setting: str) -> None:
    name, _, value = setting.partition("=")
    command = [sys.executable, "-m", "exneat_cli", "watch", "run=nowhere"]
    if value == "osmesa" and ctypes.util.find_library("OSMesa"):
        pytest.skip("OSMesa is here")
    environment = {**os.environ, name: value, "PYTHONPATH": str(Path(exneat_cli.__file__).parents[1])}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert name in done.stderr
    assert len(done.stderr.splitlines()) <= 3

"""Devices found by Warp."""

from __future__ import annotations

import functools

import warp as wp

from exneat_cli.errors import ExneatError


@functools.cache
def find_device(name: str | None) -> str:
    """Warp's name of a device: ``cuda`` means the first GPU; None means the first GPU, or ``cpu`` if there is none.

    Raises:
        ExneatError: there is no such device.
    """
    wp.config.log_level = wp.LOG_ERROR  # Warp would print the devices it finds and the modules it compiles
    wp.init()
    there = [device.alias for device in wp.get_devices()]
    wanted = "cuda:0" if name == "cuda" or (name is None and "cuda:0" in there) else name or "cpu"
    if wanted not in there:
        fix = "install the driver of an NVIDIA GPU, or set executor.device=cpu, which is slow"
        raise ExneatError(f"executor.device: expected one of {', '.join(there)}, got {name}\n  {fix}")
    return wanted

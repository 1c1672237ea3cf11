"""Python and libraries, as installed and as exneat asks for them.

It imports no other room of exneat: a missing library would keep them from loading, and it is to be named here.
"""

from __future__ import annotations

import functools
import importlib
import os
import platform
import re
import shlex
import sys
from collections.abc import Iterator, Sequence
from importlib import metadata
from typing import TYPE_CHECKING

from exneat_cli import __version__
from exneat_cli.commands.findings import BROKEN, DEGRADED, OK, Check, Finding, findings_of, in_words

if TYPE_CHECKING:
    from packaging.requirements import Requirement
    from packaging.specifiers import SpecifierSet

OPTIONAL = {
    "joblib": ("hydra-joblib-launcher==1.2.0", "runs side by side on one machine"),
    "slurm": ("hydra-submitit-launcher==1.2.0", "runs as jobs of a Slurm cluster"),
    "dask": ("dask[distributed]", "episodes on a Dask cluster"),
}
"""Extras by name: what to install where exneat's metadata does not say, and what for."""

_PARTS = ("exneat_cli.runs", "exneat_cli.analysis", "exneat_cli.commands.composition")
"""Importing these imports every other room and every library."""

_DISTRIBUTION = "exneat"


def installation_checks() -> list[Check]:
    """Python, each library that exneat asks for, and each extra."""
    return [Check("python", _python), Check("libraries", _libraries), Check("extras", _extras)]


def loading() -> Iterator[Finding]:
    """Whether all of exneat can be imported, libraries included."""
    for part in _PARTS:
        try:
            importlib.import_module(part)
        except Exception as error:
            found = f"{part} cannot be loaded, so the rest was not looked at: {in_words(error)}"
            yield Finding(BROKEN, "loading", found, _loading_remedy())
            return
    yield Finding(OK, "loading", "every part of exneat can be loaded")


def _loading_remedy() -> str:
    backend = os.environ.get("MUJOCO_GL")
    if backend:
        return f"fix the libraries above, or unset MUJOCO_GL ({backend}), which MuJoCo may be unable to serve"
    return "fix the libraries above; if they are ok, install them anew with pip install --force-reinstall"


def _python() -> Iterator[Finding]:
    from packaging.specifiers import SpecifierSet

    running = ".".join(str(part) for part in sys.version_info[:3])
    found = f"{platform.python_implementation()} {running} running exneat {__version__}"
    try:
        supported = SpecifierSet(metadata.metadata(_DISTRIBUTION)["Requires-Python"])
    except metadata.PackageNotFoundError:
        yield Finding(OK, "python", found)
        return
    if supported.contains(running):
        yield Finding(OK, "python", f"{found} (needs {_ordered(supported)})")
    else:
        remedy = f"make an environment with a Python {_ordered(supported)} and install exneat there"
        yield Finding(BROKEN, "python", f"{found}, but it needs {_ordered(supported)}", remedy)


def _libraries() -> Iterator[Finding]:
    requirements = _requirements()
    if not requirements:
        found = "exneat runs without being installed, so which versions it needs is not known"
        yield Finding(DEGRADED, "libraries", found, "install exneat: pip install . in its repository, or make ant")
    for text in requirements:
        if "extra ==" not in text:
            # Read without `packaging`, which may be the library that is missing.
            name = re.split(r"[^A-Za-z0-9._-]", text, maxsplit=1)[0]
            yield from findings_of(Check(name, functools.partial(_library, text)))


def _extras() -> Iterator[Finding]:
    requirements = _requirements()
    for name in OPTIONAL:
        yield from findings_of(Check(f"extra {name}", functools.partial(_extra, name, requirements)))


def _requirements() -> list[str]:
    """What the installed exneat asks for, extras included; empty if it is not installed."""
    try:
        return metadata.requires(_DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return []


def _library(text: str) -> Iterator[Finding]:
    from packaging.requirements import Requirement

    requirement = Requirement(text)
    if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
        return
    installed = _installed_version(requirement.name)
    needs = _ordered(requirement.specifier)
    if installed is None:
        yield Finding(BROKEN, requirement.name, f"missing, needs {needs}", _install([requirement]))
    elif requirement.specifier.contains(installed, prereleases=True):
        yield Finding(OK, requirement.name, f"{installed} (needs {needs})")
    else:
        yield Finding(DEGRADED, requirement.name, f"{installed}, but exneat needs {needs}", _install([requirement]))


def _extra(name: str, texts: Sequence[str]) -> Iterator[Finding]:
    from packaging.requirements import Requirement

    otherwise, purpose = OPTIONAL[name]
    asked = [requirement for requirement in map(Requirement, texts) if _belongs_to(name, requirement)]
    wanted = asked or [Requirement(otherwise)]
    title = f"extra {name}"
    installed = {each.name: _installed_version(each.name) for each in wanted}
    if None in installed.values():
        yield Finding(OK, title, f"not installed; for {purpose}: {_install(wanted)}")
        return
    found = ", ".join(f"{library} {version}" for library, version in installed.items())
    if all(each.specifier.contains(str(installed[each.name]), prereleases=True) for each in wanted):
        yield Finding(OK, title, f"{found}, for {purpose}")
    else:
        needs = ", ".join(f"{each.name} {_ordered(each.specifier)}" for each in wanted)
        yield Finding(DEGRADED, title, f"{found}, but exneat needs {needs}", _install(wanted))


def _belongs_to(extra: str, requirement: Requirement) -> bool:
    marker = requirement.marker
    return marker is not None and marker.evaluate({"extra": extra}) and not marker.evaluate({"extra": ""})


def _installed_version(library: str) -> str | None:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return None


def _ordered(specifier: SpecifierSet) -> str:
    """A range with its lower bound first, as people write it."""
    return ",".join(sorted(map(str, specifier), reverse=True)) or "any version"


def _install(requirements: Sequence[Requirement]) -> str:
    """The command for this very Python, whose environment need not be the one that `pip` alone means."""
    wanted = [
        each.name + (f"[{','.join(sorted(each.extras))}]" if each.extras else "") + str(each.specifier)
        for each in requirements
    ]
    return shlex.join([sys.executable, "-m", "pip", "install", *wanted])

"""index.html: the whole report on one page that works without a network, and even without scripts.

This module gathers what the page shows; the templates beside it say how.
"""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

import jinja2

from exneat_cli.analysis.catalogue import Built
from exneat_cli.analysis.study import Study, budget_sentence
from exneat_cli.errors import ExneatError
from exneat_cli.records import make_directory, write_whole

_SECTIONS = {
    "Chapter 4: figures": ("figure-4.",),
    "Chapter 5: tables and figures": ("table-5.", "figure-5."),
    "Chapter 7: figures": ("figure-7.",),
    "Comparisons": ("comparison-",),
    "Other tables and figures": ("",),
}
"""Title -> beginnings of the names of what the section shows, in this order."""
_NUMBER = re.compile(r"[\[<>]?-?\d[^A-Za-z]*")


def write_index(
    directory: Path, studies: Mapping[str, Study], artefacts: Sequence[Built], missing: Mapping[str, str]
) -> Path:
    """Write ``index.html`` into `directory`, with links relative to it; the same data give the same bytes.

    Artefacts are shown in their order within each section. `studies` are by the name of their experiment, `missing`
    holds the text of the `MissingRunsError` of what could not be built, by its name.

    Raises:
        ExneatError: a picture or a manifest cannot be read, or the page cannot be written.
    """
    loader, strict = jinja2.PackageLoader("exneat_cli.analysis"), jinja2.StrictUndefined
    jinja = jinja2.Environment(loader=loader, undefined=strict, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    jinja.filters |= {"anchor": lambda name: re.sub(r"[^\w.-]+", "-", name), "heading": _heading}
    jinja.filters |= {"below": lambda built: built.caption.removeprefix(f"{built.title}. ")}
    jinja.filters |= {"picture": _picture, "link": lambda path: Path(os.path.relpath(path, directory)).as_posix()}
    jinja.tests["numeric"] = _NUMBER.fullmatch
    page = jinja.get_template("report.html.j2").render(
        studies=[(study, _facts(study)) for study in studies.values()],
        newest=max((each.finished or "" for study in studies.values() for each in study.finished.values()), default=""),
        sections=_sections(artefacts),
        missing=list(_missing(studies, missing)),
    )
    make_directory(directory)
    path = directory / "index.html"
    write_whole(path, page + "\n")
    return path


def _sections(artefacts: Sequence[Built]) -> dict[str, list[Built]]:
    """The sections that are not empty; an artefact is in the first one that its name fits."""
    left, found = list(artefacts), {}
    for title, prefixes in _SECTIONS.items():
        found[title] = [each for prefix in prefixes for each in left if each.name.startswith(prefix)]
        left = [each for each in left if each not in found[title]]
    return {title: members for title, members in found.items() if members}


def _heading(built: Built) -> str:
    kind, _, number = built.name.partition("-")
    return f"{kind.capitalize()} {number}: {built.title}" if number[:1].isdigit() else built.title


def _picture(paths: Sequence[Path]) -> str:
    """The PNG as a data URL; empty if there is none."""
    for path in paths:
        if path.suffix == ".png":
            try:
                return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
            except OSError as error:
                raise ExneatError(f"{path}: could not be read: {error.strerror}") from error
    return ""


def _facts(study: Study) -> dict[str, Any]:
    """What the runs of a study took, by variant and in total."""
    rows = []
    for variant, label in study.variants.items():
        seeds = [run.seed for run in study.runs if run.variant == variant]
        finished = sum(run.variant == variant for run in study.reached)
        ends = dict.fromkeys((min(seeds, default=""), max(seeds, default="")))
        rows.append((label, str(finished), str(len(seeds)), " to ".join(map(str, ends))))
    versions: dict[str, set[str]] = {}
    for manifest in study.finished.values():
        for library, version in manifest.versions.items():
            versions.setdefault(library, set()).add(str(version))
    conditions = study.results["condition"].unique()
    return {
        "rows": rows,
        "env_steps": f"{study.results['env_steps'].sum():,.0f}",
        "time": timedelta(seconds=round(study.results["wall_seconds"].sum())),
        "budgets": budget_sentence([study.spent_in(each, study.trained_variants) for each in conditions]),
        "films": _films(study),
        "runs": [
            (f"{study.variants[run.variant]}, {study.conditions[run.condition]}, seed {run.seed}", run.directory.path)
            for run in study.finished
        ],
        "versions": ", ".join(f"{library} {' and '.join(sorted(found))}" for library, found in versions.items()),
    }


def _films(study: Study) -> dict[str, Path]:
    """For each variant and condition, in words, the film of the filmed run that was best on validation episodes."""
    best: dict[str, tuple[float, Path]] = {}
    for run, manifest in study.finished.items():
        film, result = run.directory.plots / "champion.mp4", manifest.result
        if result is not None and result.validation is not None and film.exists():
            words = f"{study.variants[run.variant]}, {study.conditions[run.condition]}"
            if words not in best or result.validation > best[words][0]:
                best[words] = result.validation, film
    return {words: film for words, (_, film) in best.items()}


def _missing(studies: Mapping[str, Study], missing: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
    """(name, what it lacks, command that makes it) of studies and artefacts."""
    for study in studies.values():
        unfinished = len(study.runs) - len(study.reached)
        if unfinished:
            yield study.experiment, f"{unfinished} of {len(study.runs)} runs are not finished", study.command
    for name, message in missing.items():
        why, _, command = message.partition("\n")
        yield name, why, command.strip()

"""index.html: the whole report on one page that works without network and without scripts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from exneat_cli.analysis.artefacts import Built
from exneat_cli.analysis.captions import budgets_sentence
from exneat_cli.analysis.page_frame import anchor, file_links, page, picture, table, text
from exneat_cli.analysis.study import Study
from exneat_cli.records import Manifest, make_directory, write_whole

_SECTIONS = (
    ("chapter-4", "Chapter 4: figures", ("figure-4.",)),
    ("chapter-5", "Chapter 5: tables and figures", ("table-5.", "figure-5.")),
    ("chapter-7", "Chapter 7: figures", ("figure-7.",)),
    ("comparisons", "Comparisons", ("comparison-",)),
)
_OTHERS = ("others", "Others")


def write_index(
    directory: Path, studies: Mapping[str, Study], artefacts: Sequence[Built], missing: Mapping[str, str]
) -> Path:
    """Write ``index.html``; the same data gives the same bytes.

    Args:
        directory: of the report; made if need be. Links to files are relative to it.
        studies: by the name of their experiment.
        artefacts: what was built, in the order in which it is to be shown within its section.
        missing: name of what could not be built -> the text of its `MissingRunsError`.

    Returns:
        Path of the page.

    Raises:
        ExneatError: a picture or a manifest cannot be read, or the page cannot be written.
    """
    sections = _in_sections(artefacts)
    body = [
        "<h1>Report</h1>",
        *_contents(studies, sections),
        '<h2 id="what-was-run">What was run</h2>',
        *(part for study in studies.values() for part in _run_part(study)),
    ]
    for (name, title), members in sections.items():
        body += [f'<h2 id="{name}">{title}</h2>', *(_artefact_part(directory, each) for each in members)]
    body += ['<h2 id="missing">What is missing</h2>', *_missing_parts(studies, missing)]
    make_directory(directory)
    path = directory / "index.html"
    write_whole(path, page("exneat report", body))
    return path


def _in_sections(artefacts: Sequence[Built]) -> dict[tuple[str, str], list[Built]]:
    """Sections that hold something, with what they hold; whatever fits nowhere comes last."""
    left = list(artefacts)
    found: dict[tuple[str, str], list[Built]] = {}
    for name, title, prefixes in _SECTIONS:
        found[name, title] = [each for prefix in prefixes for each in left if each.name.startswith(prefix)]
        left = [each for each in left if not each.name.startswith(prefixes)]
    found[_OTHERS] = left
    return {section: members for section, members in found.items() if members}


def _contents(studies: Mapping[str, Study], sections: Mapping[tuple[str, str], Sequence[Built]]) -> Iterator[str]:
    yield '<nav aria-label="Contents"><ul>'
    experiments = [(f"run-{name}", name) for name in studies]
    yield _entry("what-was-run", "What was run", experiments)
    for (name, title), members in sections.items():
        yield _entry(name, title, [(each.name, _heading(each)) for each in members])
    yield _entry("missing", "What is missing", [])
    yield "</ul></nav>"


def _entry(name: str, title: str, below: Sequence[tuple[str, str]]) -> str:
    lower = "".join(f'<li><a href="#{anchor(each)}">{text(words)}</a></li>' for each, words in below)
    return f'<li><a href="#{name}">{title}</a>{f"<ul>{lower}</ul>" if below else ""}</li>'


def _heading(built: Built) -> str:
    kind, _, number = built.name.partition("-")
    return f"{kind.capitalize()} {number}: {built.title}" if number[:1].isdigit() else built.title


def _run_part(study: Study) -> Iterator[str]:
    manifests = [run.directory.read_manifest() for run in study.finished]
    spent = [manifest.budget_spent for manifest in manifests if manifest.budget_spent]
    steps = sum(each["env_steps"] for each in spent)
    took = _duration(sum(each["wall_seconds"] for each in spent))
    rows = [_variant_row(study, variant) for variant in study.variants]
    conditions = [c for c in study.conditions if any(study.of(c, variant) for variant in study.trained_variants)]
    yield f'<h3 id="{anchor(f"run-{study.experiment}")}">{text(study.experiment)}</h3>'
    yield f"<p>Claim: {text(study.claim)}</p>"
    yield (
        f"<p>Budget {text(study.budget)}: {len(study.finished)} of {len(study.runs)} runs finished, "
        f"{steps:,} environment steps of training, {took} of training time.</p>"
    )
    yield table(f"Runs of {study.experiment}", ("variant", "runs finished", "runs planned", "seeds"), rows)
    yield f"<p>{text(budgets_sentence(study, conditions, study.trained_variants))}</p>"
    yield f"<p>Versions: {text(_versions(manifests) or 'none, as no run is finished')}.</p>"


def _variant_row(study: Study, variant: str) -> tuple[str, ...]:
    planned = [run for run in study.runs if run.variant == variant]
    finished = sum(run.variant == variant for run in study.finished)
    return (study.variants[variant], str(finished), str(len(planned)), _ranges(sorted({run.seed for run in planned})))


def _versions(manifests: Sequence[Manifest]) -> str:
    found: dict[str, set[str]] = {}
    for manifest in manifests:
        for library, version in manifest.versions.items():
            found.setdefault(library, set()).add(str(version))
    return ", ".join(f"{library} {' and '.join(sorted(versions))}" for library, versions in found.items())


def _ranges(seeds: Sequence[int]) -> str:
    """Ascending whole numbers in words, e.g. ``0 to 2, 5``."""
    parts: list[list[int]] = []
    for seed in seeds:
        if parts and seed == parts[-1][-1] + 1:
            parts[-1].append(seed)
        else:
            parts.append([seed])
    return ", ".join(f"{part[0]} to {part[-1]}" if len(part) > 1 else str(part[0]) for part in parts)


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60.0)
    if minutes < 1:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def _artefact_part(directory: Path, built: Built) -> str:
    heading = _heading(built)
    shown = table(heading, built.header, built.rows) if built.rows else picture(heading, built.paths)
    return "\n".join(
        [
            f'<h3 id="{anchor(built.name)}">{text(heading)}</h3>',
            shown,
            f'<p class="caption">{text(built.caption)}</p>',
            f"<p>Files: {file_links(directory, built.paths)}</p>",
        ]
    )


def _missing_parts(studies: Mapping[str, Study], missing: Mapping[str, str]) -> Iterator[str]:
    items = []
    for study in studies.values():
        unfinished = len(study.runs) - len(study.finished)
        if unfinished:
            counted = f"{unfinished} of {len(study.runs)} runs are not finished"
            items.append((study.experiment, counted, study.command))
    for name, message in missing.items():
        why, _, command = message.partition("\n")
        items.append((name, why, command.strip()))
    if not items:
        yield "<p>Nothing.</p>"
        return
    yield "<ul>"
    for name, why, command in items:
        fixed_by = f"<pre><code>{text(command)}</code></pre>" if command else ""
        yield f"<li><strong>{text(name)}</strong>: {text(why)}{fixed_by}</li>"
    yield "</ul>"

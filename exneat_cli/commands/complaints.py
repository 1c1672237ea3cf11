"""Complaints of Hydra and OmegaConf, put in our words."""

from __future__ import annotations

import re
from pathlib import Path

_LONGEST_LINE = 300


def in_our_words(error: Exception, conf: Path) -> str:
    """One to three lines that name the key or the file.

    Args:
        error: what Hydra or OmegaConf raised.
        conf: exneat's own configuration, whose options are listed where one does not exist.
    """
    text = str(error) or str(error.__cause__ or "") or type(error).__name__
    if unknown := re.match(r"Could not override '(.+?)'", text):
        return f"{unknown[1]}: unknown key; exneat train --help lists all of them"
    if unknown := re.search(r"Could not find '(.+)/(.*?)'", text):
        options = re.search(r"Available options in '.+':\n((?:\t.+\n?)+)", text)
        known = ", ".join(options[1].split()) if options else "none"
        return f"{unknown[1]}={unknown[2]}: no such option; known: {known}"
    if unknown := re.search(r"Could not load '(.+)/(.*?)'", text):
        known = ", ".join(sorted(path.stem for path in (conf / unknown[1]).glob("*.yaml")))
        return f"{unknown[1]}={unknown[2]}: no such option; known: {known}"
    if dangling := re.search(r"Interpolation key '(.+?)' not found\s+full_key: (\S+)", text):
        return f"{dangling[2]}: refers to {dangling[1]}, which no configuration file and no override sets"
    if loaded := re.match(r"Invalid loaded object type: (\w+)", text):
        return f"a configuration file holds {loaded[1]}, expected keys with values"
    if isinstance(error, RecursionError):
        return "a configuration file leads back to itself through its defaults, or values do through ${...}"
    if located := re.search(r"\n\s+full_key: (\S+)", text):
        reason = text.splitlines()[0]
        return f"{located[1]}: {reason[:_LONGEST_LINE]}"
    cause = error.__cause__
    lines = [line.strip() for line in f"{text}\n{cause or ''}".splitlines() if line.strip()]
    kept = [lines[0], " ".join(lines[1:])] if len(lines) > 3 else lines
    return "\n  ".join(line[:_LONGEST_LINE] for line in kept)

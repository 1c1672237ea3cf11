"""The page of a report in headless Chromium: sorted, filtered, narrow, dark, on paper, and without the network."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.analysis.test_index_page import a_report

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
TRIAL = """
<script>
const table = document.querySelector("#comparison-track + .scroll table");
const column = (k) => [...table.tBodies[0].rows].filter((row) => !row.hidden).map((row) => row.cells[k].textContent);
const training = [...table.tHead.rows[0].cells].findIndex((cell) => cell.textContent === "training");
const before = column(1);
const click = () => table.tHead.rows[0].cells[training].querySelector("button").click();
click();
const up = column(training);
click();
const down = column(training);
click();
const after = column(1);
const box = [...document.querySelectorAll("#filter label")].find((label) => label.textContent.trim() === "ExNEAT");
box.querySelector("input").click();
const [style] = document.styleSheets;
const shownAs = (condition, ask) => {
  const rule = [...style.cssRules].find((rule) => rule.media && rule.media.mediaText === condition);
  rule.media.mediaText = "all";
  const answer = ask((query) => getComputedStyle(document.querySelector(query)));
  rule.media.mediaText = condition;
  return answer;
};
const filtered = column(1);
const asked = performance.getEntriesByType("resource").map((entry) => entry.name.slice(0, 5));
const width = document.documentElement.scrollWidth;
const ofDark = "screen and (prefers-color-scheme: dark)";
const dark = shownAs(ofDark, (look) => [look("body").backgroundColor, look("body").color]);
document.body.style.width = "700px";  // A4 without its margins
const paper = shownAs("print", (look) => ({
  rows: [...table.tBodies[0].rows].filter((row) => row.getBoundingClientRect().height > 0).length,
  widest: Math.max(...[...document.querySelectorAll("table")].map((each) => each.getBoundingClientRect().width)),
  cut: look(".scroll").overflowX, afterHeading: look("h2").breakAfter, withinFigure: look("img").breakInside,
}));
document.body.style.width = "350px";
const broken = shownAs("print", () => [...document.querySelectorAll("td.number")].filter((cell) => {
  const words = document.createRange();
  words.selectNodeContents(cell);
  return !cell.textContent.trim().includes(" ") && words.getClientRects().length > 1;
}).map((cell) => cell.textContent));
document.body.dataset.found = JSON.stringify({
  before, up, down, after, filtered, asked, width, room: innerWidth, dark, paper, broken,
});
</script>
"""


def tried(page: Path) -> tuple[dict[str, Any], str]:
    """What the trial found in a window of 400 pixels, and what the browser complained of."""
    assert BROWSER is not None
    page.write_text(page.read_text().replace("</body>", f"{TRIAL}</body>"))
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--window-size=400,800", "--enable-logging=stderr"]
    command = [BROWSER, *flags, f"--user-data-dir={page.parent / 'profile'}", "--dump-dom", page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    found = re.search(r'data-found="([^"]*)"', done.stdout)
    assert found is not None, done.stdout[-1000:]
    return json.loads(html.unescape(found[1])), "\n".join(
        line for line in done.stderr.splitlines() if "CONSOLE" in line and "made up" not in line
    )


@pytest.mark.skipif(BROWSER is None, reason="Chromium is not installed here")
def test_the_page_is_sorted_filtered_narrow_dark_and_printed_without_network_or_complaints(tmp_path: Path) -> None:
    found, complaints = tried(a_report(tmp_path))
    numbers = [float(text) for text in found["up"] if text]
    assert len(set(numbers)) > 1
    assert numbers == sorted(numbers)
    assert [float(text) for text in found["down"] if text] == sorted(numbers, reverse=True)
    assert found["up"][-1] == found["down"][-1] == ""  # a baseline, which is not trained
    assert found["before"] == found["after"] == ["NEAT", "ExNEAT", "random actions"] * 2
    assert found["filtered"] == ["NEAT", "random actions"] * 2
    assert not [kind for kind in found["asked"] if kind.startswith("http")]
    assert found["width"] <= found["room"]
    ground, words = (sum(map(int, re.findall(r"\d+", colour))) for colour in found["dark"])
    assert ground < 150 < 600 < words
    assert found["paper"].pop("widest") <= 700
    assert found["paper"] == {"rows": 6, "cut": "visible", "afterHeading": "avoid", "withinFigure": "avoid"}
    assert not found["broken"], "numbers that are cut in two where a table is wider than the paper"
    assert not complaints

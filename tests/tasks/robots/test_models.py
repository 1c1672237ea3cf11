"""Files of models: what they were when they were last looked at does not count."""

from __future__ import annotations

from pathlib import Path

import pytest

from exneat_cli.errors import ConfigError
from exneat_cli.tasks.robots.models import digest_of, files_of, load

MAIN = """<mujoco><worldbody><include file="{included}"/></worldbody></mujoco>"""
LEG = """<mujocoinclude><body name="leg"><geom size="{size}"/></body></mujocoinclude>"""
NESTING = """<mujocoinclude><include file="leg.xml"/></mujocoinclude>"""


@pytest.mark.parametrize("included", ["leg.xml", "nesting.xml"])
def test_a_change_of_an_included_file_is_noticed_within_one_program(tmp_path: Path, included: str) -> None:
    model, leg = tmp_path / "robot.xml", tmp_path / "leg.xml"
    model.write_text(MAIN.format(included=included))
    (tmp_path / "nesting.xml").write_text(NESTING)
    leg.write_text(LEG.format(size=0.1))
    digest, loaded = digest_of(str(model)), load(str(model))
    assert (digest_of(str(model)), load(str(model)) is loaded) == (digest, True)
    leg.write_text(LEG.format(size=0.25))
    assert digest_of(str(model)) != digest
    assert load(str(model)).geom_size[0, 0] == 0.25
    assert files_of(str(model))["leg.xml"] == leg.read_bytes()
    leg.unlink()
    with pytest.raises(ConfigError, match=r"leg\.xml"):
        load(str(model))
    leg.write_text(LEG.format(size=0.1))
    assert digest_of(str(model)) == digest


def test_another_file_that_is_included_later_belongs_to_the_model(tmp_path: Path) -> None:
    model, nesting = tmp_path / "robot.xml", tmp_path / "nesting.xml"
    model.write_text(MAIN.format(included="nesting.xml"))
    nesting.write_text("<mujocoinclude/>")
    (tmp_path / "leg.xml").write_text(LEG.format(size=0.1))
    assert sorted(files_of(str(model))) == ["nesting.xml", "robot.xml"]
    nesting.write_text(NESTING)
    assert sorted(files_of(str(model))) == ["leg.xml", "nesting.xml", "robot.xml"]

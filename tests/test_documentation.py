"""What the README and the notebooks promise: commands that parse, files that are there, tables that results wrote."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from experiments.make_tables import pages
from jaxbrdf import cli
from tests.source import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
NOTEBOOKS = sorted((ROOT / "experiments").glob("*.ipynb"))


def commands(page: Path) -> list[str]:
    """Lines of code blocks that call `jaxbrdf`, without comments; those that leave a choice open are left out."""
    blocks = re.findall(r"^```\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.splitlines() if line.startswith("jaxbrdf ")]
    return [line for line in lines if "[" not in line]


def test_there_are_commands_in_the_readme():
    assert len(commands(ROOT / "README.md")) >= 8


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_commands_are_understood(page: Path):
    for line in commands(page):
        words = shlex.split(line, comments=True)
        assert callable(cli.parser().parse_args(words[1:]).run), line


def test_links_of_the_readme_lead_somewhere():
    links = re.findall(r"\]\(([^)#]+)(#[^)]*)?\)", (ROOT / "README.md").read_text())
    assert links
    for path, anchor in links:
        assert (ROOT / path).is_file(), path
        headings = re.findall(r"^#+ (.*)$", (ROOT / path).read_text(), re.MULTILINE) if anchor else []
        assert not anchor or anchor[1:] in [heading.lower().replace(" ", "-") for heading in headings], anchor


def test_tables_are_what_the_results_say():
    stale = [str(path.relative_to(ROOT)) for path, text in pages().items() if path.read_text() != text]
    assert not stale, f"run python experiments/make_tables.py: {stale}"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_a_notebook_is_stripped_and_uses_public_names(path: Path):
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    assert cells
    for cell in cells:
        assert not cell["outputs"]
        assert cell["execution_count"] is None
        assert not re.search(r"(\bimport |\.)_\w", "".join(cell["source"]))

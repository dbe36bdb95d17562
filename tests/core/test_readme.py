"""What the README says of the tests is true."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NAMED = re.compile(r"`((?:tests/\w+/)?test_\w+\.py)::(\w+)`")


@pytest.mark.parametrize(
    "found", sorted(set(NAMED.findall((ROOT / "README.md").read_text("utf-8"))))
)
def test_each_test_that_the_readme_names_exists(found):
    place, name = found
    path = ROOT / place if "/" in place else ROOT / "tests" / "app" / place
    tree = ast.parse(path.read_text("utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_the_readme_names_a_test_for_each_feature():
    assert len(NAMED.findall((ROOT / "README.md").read_text("utf-8"))) > 60

"""CITATION.cff is valid Citation File Format and names the version that is installed."""

import copy
import json
import tomllib
from pathlib import Path

import jsonschema
import pytest
import yaml

import pam_envs

ROOT = Path(__file__).parents[1]
SCHEMA = json.loads((ROOT / "tests/schemas/citation.json").read_text())


@pytest.fixture
def citation():
    return yaml.safe_load((ROOT / "CITATION.cff").read_text())


def test_citation_file_is_valid(citation):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(citation, SCHEMA)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("cff-version", None),
        ("title", None),
        ("authors", []),
        ("authors", [{}]),
        ("version", 0.1),
        ("date-released", "November 2026"),
        ("licence", "MIT"),
    ],
)
def test_invalid_citation_field_is_refused(citation, field, value):
    wrong = copy.deepcopy(citation)
    wrong[field] = value
    if value is None:
        del wrong[field]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(wrong, SCHEMA)


def test_version_and_licence_are_the_same_everywhere(citation):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert citation["version"] == project["version"] == pam_envs.__version__
    assert citation["license"] == project["license"]
    assert f"## [{pam_envs.__version__}]" in (ROOT / "CHANGELOG.md").read_text()

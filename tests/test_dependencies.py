"""Dependencies of the installation without extras."""

import tomllib
from importlib import metadata
from pathlib import Path

from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

LARGE = {"numpy", "scipy", "numba", "gymnasium"}
"""Packages that every user of the field has; what they bring does not count."""


def needs(package: str) -> set[str]:
    """Return the direct requirements of an installed package without extras."""
    found = map(Requirement, metadata.requires(package) or ())
    here = {**default_environment(), "extra": ""}
    return {
        canonicalize_name(one.name) for one in found if not one.marker or one.marker.evaluate(here)
    }


def closure(packages: set[str]) -> set[str]:
    """Return the packages with everything that they bring."""
    found: set[str] = set()
    while packages:
        found |= packages
        packages = set().union(*map(needs, packages)) - found
    return found


def test_core_brings_at_most_five_packages_beside_the_large_ones():
    pyproject = Path(__file__).parents[1] / "pyproject.toml"
    lines = tomllib.loads(pyproject.read_text(encoding="utf-8"))["project"]["dependencies"]
    core = {canonicalize_name(Requirement(line).name) for line in lines}
    assert core > LARGE
    added = closure(core) - closure(LARGE)
    assert len(added) <= 5, sorted(added)

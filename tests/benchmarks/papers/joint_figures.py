"""Figures of the joint, computed once for all tests of them."""

from __future__ import annotations

from functools import cache

from benchmarks.papers import joint as papers_joint
from benchmarks.papers.published import Figure

REACHED = {
    ("study", 5.0, True),
    ("study", 5.0, False),
    ("study", 10.0, True),
    ("reduced", 5.0, True),
    ("paper", 5.0, True),
    ("paper", 5.0, False),
}
"""Plant, size and turn at which model-following rises 1.2 times faster than the same PI."""


@cache
def figures() -> dict[str, Figure]:
    """Return every figure of the joint by its name."""
    groups = papers_joint.GROUPS
    made = [figure for group in groups for figure in group()]
    assert len({figure.name for figure in made}) == len(made)
    return {figure.name: figure for figure in made}

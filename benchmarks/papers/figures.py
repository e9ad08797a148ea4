"""Figures of all papers."""

from __future__ import annotations

from benchmarks.papers import elbow, gait, joint, knee, knee_envs, manipulator, positioning
from benchmarks.papers.published import Figure, Group

GROUPS: tuple[Group, ...] = (
    *positioning.GROUPS,
    *(*knee.GROUPS, *gait.GROUPS, *knee_envs.GROUPS),
    *elbow.GROUPS,
    *joint.GROUPS,
    *manipulator.GROUPS,
)


def all_figures() -> list[Figure]:
    """Return every figure; a group that fails is replaced by one line with the reason."""
    figures: list[Figure] = []
    for group in GROUPS:
        try:
            figures += group()
        except (ModuleNotFoundError, AttributeError) as error:
            title = (group.__doc__ or group.__name__).splitlines()[0].rstrip(".")
            note = f"not there: {error}"
            figures.append(Figure(title, None, note=note))
    return figures

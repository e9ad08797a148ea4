"""Figures of all papers."""

from collections.abc import Sequence

from benchmarks.papers import (
    elbow,
    equations,
    gait,
    inventory,
    joint,
    knee,
    knee_envs,
    manipulator,
    positioning,
)
from benchmarks.papers.published import Figure, Group, compared
from sweeps.progress import Start, unnoticed

BY_PAPER: dict[str, tuple[Group, ...]] = {
    "yeh2010": (*equations.KNEE_GROUPS, *knee.GROUPS, *gait.GROUPS, *knee_envs.GROUPS),
    "chakarov2018": (*equations.ELBOW_GROUPS, *elbow.GROUPS),
    "fluidic_muscles": (*equations.JOINT_GROUPS, *joint.GROUPS, *manipulator.GROUPS),
    "positioning2021": (*equations.MUSCLE_GROUPS, *positioning.GROUPS),
}
GROUPS: tuple[Group, ...] = tuple(group for groups in BY_PAPER.values() for group in groups)


def all_figures(
    papers: Sequence[str] = (), places: Sequence[str] = (), start: Start = unnoticed
) -> list[Figure]:
    """Return every figure, or those of some papers and places of the inventory.

    A group that fails is replaced by one line with the reason.
    """
    for name in papers:
        if name not in BY_PAPER:
            raise ValueError(f"paper {name!r}; choose one of {', '.join(BY_PAPER)}")
    listed = {place for name in papers or BY_PAPER for place in inventory.items()[name]}
    for place in places:
        if place not in listed:
            raise ValueError(f"no place {place!r} in the inventory; an example is 'Eq. (1)'")
    figures: list[Figure] = []
    advance = start(sum(len(BY_PAPER[name]) for name in papers or BY_PAPER))
    for paper in papers or BY_PAPER:
        for group in BY_PAPER[paper]:
            try:
                figures += compared(paper, group)
            except (ModuleNotFoundError, AttributeError) as error:
                title = (group.__doc__ or group.__name__).splitlines()[0].rstrip(".")
                figures.append(Figure(title, None, note=f"not there: {error}"))
            advance(note=f", {paper}")
        figures += inventory.stated(paper)
    return [f for f in figures if not places or not {*places}.isdisjoint(f.places)]

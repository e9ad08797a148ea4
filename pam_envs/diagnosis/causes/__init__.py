"""Catalogue of causes: each file below this folder declares one as ``CAUSE``."""

import runpy
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from pathlib import Path

from pam_envs.diagnosis.cause import Cause
from pam_envs.wording import near

FOLDER = Path(__file__).parent


def _files(folder: Path) -> list[Path]:
    """Return the Python files of a folder and its subfolders, without package files."""
    return sorted(path for path in folder.rglob("*.py") if path.name != "__init__.py")


@cache
def catalogue() -> tuple[Cause, ...]:
    """Return the shipped causes, sorted by name; a new file is found without registration."""
    names = [path.relative_to(FOLDER).with_suffix("").parts for path in _files(FOLDER)]
    found = [import_module(".".join((__name__, *parts))).CAUSE for parts in names]
    return tuple(sorted(found, key=lambda cause: cause.name))


def causes_in(folder: str | Path) -> tuple[Cause, ...]:
    """Return the causes that the Python files of a folder declare as ``CAUSE``; else ValueError."""
    made = []
    for path in _files(Path(folder)):
        cause = runpy.run_path(str(path)).get("CAUSE")
        if not isinstance(cause, Cause):
            raise ValueError(f"{path} declares no cause; assign a Cause to the name CAUSE")
        made.append(cause)
    if not made:
        raise ValueError(f"{folder} holds no Python file; each file declares one cause as CAUSE")
    return tuple(sorted(made, key=lambda cause: cause.name))


def by_name(name: str, causes: Sequence[Cause] | None = None) -> Cause:
    """Return one cause by its name, by default of the catalogue."""
    every = catalogue() if causes is None else causes
    for cause in every:
        if cause.name == name:
            return cause
    raise ValueError(f"no cause named {name!r}{near(name, [c.name for c in every])}")


def selected(
    given: Sequence[Cause | str] | None = None, causes: Sequence[Cause] | None = None
) -> tuple[Cause, ...]:
    """Return the given causes, with names looked up among ``causes``; all of them by default.

    The default of ``causes`` is the catalogue.
    """
    if given is None:
        return catalogue() if causes is None else tuple(causes)
    if isinstance(given, str):
        raise TypeError(f"causes is {given!r}; give a list of causes or names")
    made: list[Cause] = []
    for one in given:
        cause = by_name(one, causes) if isinstance(one, str) else one
        if not isinstance(cause, Cause):
            raise TypeError(f"causes holds {one!r}; give a Cause or the name of one")
        if cause.name in {c.name for c in made}:
            raise ValueError(f"causes holds {cause.name!r} twice; give each once")
        made.append(cause)
    if not made:
        raise ValueError("causes is empty; name at least one, or leave it out for the catalogue")
    return tuple(made)

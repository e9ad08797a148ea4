"""Entry points by which other distributions add environments, muscles and controllers.

In the ``pyproject.toml`` of the other distribution::

    [project.entry-points."pam_envs.environments"]
    spring_muscle = "spring_muscle"        # package that declares ENVIRONMENTS

    [project.entry-points."pam_envs.muscles"]
    dmsp20 = "my_muscles:dmsp20"           # plant, or function without arguments that returns one

    [project.entry-points."pam_envs.controllers"]
    mine = "my_controllers"                # module that declares ENTRIES

The environments are registered with Gymnasium, ``plant="dmsp20"`` selects the muscle, and the
catalogue of controllers includes the entries. An entry point that cannot be loaded is reported by a
warning and left out.
"""

import warnings
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import Any

ENVIRONMENTS = "pam_envs.environments"
MUSCLES = "pam_envs.muscles"
CONTROLLERS = "pam_envs.controllers"


def each(group: str, use: Callable[[EntryPoint], Any]) -> None:
    """Call ``use`` with every entry point of a group; warn of those that raise."""
    for found in sorted(entry_points(group=group), key=lambda one: one.name):
        try:
            use(found)
        except Exception as error:  # code of another distribution
            warnings.warn(
                f"entry point {found.name} = {found.value!r} of {group} is left out: "
                f"{type(error).__name__}: {error}; repair or uninstall its distribution",
                RuntimeWarning,
                stacklevel=2,
            )


def muscle(name: str) -> Any:
    """Return the plant of an entry point, None if there is none of that name."""
    for found in entry_points(group=MUSCLES, name=name):
        made = found.load()
        return made() if callable(made) else made
    return None

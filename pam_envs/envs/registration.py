"""Registration of environment families with Gymnasium."""

import importlib
import os
import pkgutil
from types import ModuleType

import gymnasium as gym

from pam_envs.entry_points import ENVIRONMENTS, each

NAMESPACE = "PAM/"
FAMILIES = "PAM_ENVS_FAMILIES"
"""Environment variable with the import names of further families, separated by commas."""


def register_family(family: ModuleType | str) -> tuple[str, ...]:
    """Register the environments of a family, a package or its import name; return their ids.

    Its ``ENVIRONMENTS`` maps each id to ``module:Name``: ``NameEnv`` in that module is the single
    environment and ``NameVectorEnv`` the batch. Ids that are registered already stay as they are.
    """
    package = importlib.import_module(family) if isinstance(family, str) else family
    declared: dict[str, str] = getattr(package, "ENVIRONMENTS", {})
    if not declared:
        raise ValueError(
            f"{package.__name__} declares no ENVIRONMENTS; give a mapping from id to 'module:Name'"
        )
    for name, place in declared.items():
        if name not in gym.registry:
            gym.register(
                name,
                entry_point=f"{package.__name__}.{place}Env",
                vector_entry_point=f"{package.__name__}.{place}VectorEnv",
                order_enforce=False,  # the environment itself requires reset() before step()
                disable_env_checker=True,  # the checks run in the tests, not in every user's steps
            )
    return tuple(declared)


def register_all() -> None:
    """Register every family.

    These are the folders beside this module, those of entry points, and those of ``FAMILIES``.
    """
    package = importlib.import_module(__name__.rpartition(".")[0])
    for found in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        if found.ispkg and hasattr(importlib.import_module(found.name), "ENVIRONMENTS"):
            register_family(found.name)
    each(ENVIRONMENTS, lambda found: register_family(found.module))
    for name in filter(None, os.environ.get(FAMILIES, "").split(",")):
        register_family(name)


def full_id(name: str) -> str:
    """Return an id with its namespace: PAM/KneeWalk-v0 for KneeWalk-v0."""
    return name if "/" in name else f"{NAMESPACE}{name}"

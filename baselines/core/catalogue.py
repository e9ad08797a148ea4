"""Catalogue of the classical controllers by name.

Each module of this package that defines controllers holds their entries in ``ENTRIES``, a dict of
:class:`~baselines.core.entry.Entry` by name; the catalogue collects them. Third-party controllers
are added by :func:`register`, by :func:`load` from a folder of such modules, by folders in the
environment variable ``PAM_ENVS_CONTROLLERS`` (separated as in ``PATH``), or by modules of other
distributions (:mod:`pam_envs.entry_points`); command lines read the last two as well. Controllers
of the variable's folders run in processes of their own (:mod:`baselines.core.isolated`).

A controller is built from a nominal plant and the named signals, never from an environment. Its
model knowledge is part of its result. For "nominal model" the caller provides the model: if that is
the simulated plant itself without randomization, the controller knows the true model, and a table
of results should report it. For "true model" (:mod:`baselines.core.informed`) it provides the plant
of the episode, with the parameters that were drawn.

Numbers that neither a rule nor a paper fixes are *knobs* (:mod:`baselines.core.entry`). Names with
``_tuned`` are controllers with knobs from a search (:mod:`baselines.core.tuned`).
"""

import importlib
import importlib.util
import os
import pkgutil
import re
import sys
from pathlib import Path
from typing import Any

import baselines
from baselines.core import informed, isolated, tuned
from baselines.core.controller import Controller
from baselines.core.entry import AS_DESIGNED, Entry, Knobs, Spec, check_knobs
from pam_envs import entry_points
from pam_envs.parameters import Signals
from pam_envs.wording import near, shown

VARIABLE = "PAM_ENVS_CONTROLLERS"
NAME = re.compile(r"[A-Za-z0-9_]{1,100}")
"""Names of controllers, which are also names of files."""
PUBLISHED: dict[str, Entry] = {}
"""Controllers tuned by rule or as published."""
CONTROLLERS: dict[str, Entry] = {}
"""All controllers, including those with knobs from a search."""


def register(name: str, entry: Entry) -> None:
    """Add a controller to the catalogue.

    Raises
    ------
    ValueError
        If the name is taken, or has other characters than letters, digits and underscores.
    """
    if not NAME.fullmatch(name):
        raise ValueError(
            f"controller {shown(name)}: a name has at most 100 letters, digits and underscores"
        )
    if name in CONTROLLERS:
        raise ValueError(f"a controller named {name!r} is registered already; choose another name")
    PUBLISHED[name] = CONTROLLERS[name] = entry


def load(folder: str | Path) -> list[str]:
    """Register the controllers of all Python files in a folder; return their names.

    Parameters
    ----------
    folder : str or Path
        Each file defines ``ENTRIES``, a dict of :class:`~baselines.core.entry.Entry` by name.

    Raises
    ------
    ValueError
        If the folder has no such file, or a name is taken.
    """
    names: list[str] = []
    for file in sorted(Path(folder).glob("*.py")):
        module = f"pam_envs_controllers_{file.stem}"
        spec = importlib.util.spec_from_file_location(module, file)
        assert spec is not None and spec.loader is not None
        sys.modules[module] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[module])
        names += _register_entries(sys.modules[module])
    if not names:
        raise ValueError(f"{folder} has no Python file with ENTRIES; see baselines.core.catalogue")
    return names


def make_controller(
    name: str,
    plant: Any,
    signals: Signals,
    action_signals: Signals,
    seed: int = 0,
    knobs: Knobs = AS_DESIGNED,
) -> Controller:
    """Return a controller by name.

    Parameters
    ----------
    name : str
        One of ``CONTROLLERS``.
    plant : Plant
        Nominal plant; not used by controllers with knowledge "nothing" or "tables".
    signals, action_signals, seed, knobs
        See :class:`~baselines.core.entry.Spec`.

    Raises
    ------
    ValueError
        If the controller does not exist, has no such knob or value, or is for another class of
        plants.
    ModuleNotFoundError
        If its design needs a package that is not installed; the message names the extra.
    """
    entry = CONTROLLERS.get(name)
    if entry is None:
        raise ValueError(f"no controller named {name!r}{near(name, CONTROLLERS)}")
    check_knobs(name, entry.knobs, knobs)
    if entry.plants and not isinstance(plant, entry.plants):
        raise ValueError(
            f"{name} is for a {' or '.join(family.__name__ for family in entry.plants)}, and the "
            f"plant is a {type(plant).__name__}; for this plant there are: "
            + ", ".join(
                n for n, e in CONTROLLERS.items() if not e.plants or isinstance(plant, e.plants)
            )
        )
    factors = {**entry.found, **knobs}
    try:
        made: Controller = entry.make(Spec(plant, signals, action_signals, factors, seed))
    except ModuleNotFoundError as error:
        extra = "synthesis" if error.name == "slycot" else "baselines"
        raise ModuleNotFoundError(
            f"{name} needs {error.name}, which is not installed: pip install 'pam-envs[{extra}]'",
            name=error.name,
        ) from error
    return made


def _register_entries(module: Any) -> list[str]:
    entries: dict[str, Entry] = getattr(module, "ENTRIES", {})
    for name, entry in entries.items():
        register(name, entry)
    return list(entries)


def _collect() -> None:
    package = baselines.__name__
    for found in pkgutil.walk_packages(baselines.__path__, f"{package}."):
        if not found.name.startswith(f"{package}.core"):
            _register_entries(importlib.import_module(found.name))
    CONTROLLERS.update(tuned.entries(PUBLISHED, tuned.read()))
    CONTROLLERS.update(informed.entries(PUBLISHED))
    entry_points.each(entry_points.CONTROLLERS, lambda found: _register_entries(found.load()))
    for folder in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
        for name, entry in isolated.entries(folder).items():
            register(name, entry)


_collect()

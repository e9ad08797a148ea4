"""Import of a checkout's folders ``baselines``, ``agents`` and ``sweeps`` as parts of the package.

The wheel holds them as ``pam_envs.baselines``, ``pam_envs.agents`` and ``pam_envs.sweeps``. In a
checkout they are beside the package; :func:`install` makes these names refer to the same modules.
"""

import sys
from collections.abc import Sequence
from importlib import import_module, util
from importlib.abc import InspectLoader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import CodeType, ModuleType

PACKAGE = Path(__file__).resolve().parent
FOLDERS = ("baselines", "agents", "sweeps")


class Aliases(MetaPathFinder, InspectLoader):
    """Finder and loader of ``pam_envs.baselines.x`` as the module ``baselines.x``."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the specification of an alias, None for any other name."""
        package, _, own = name.partition(".")
        if package != PACKAGE.name or own.partition(".")[0] not in FOLDERS:
            return None
        found = util.find_spec(own)
        if found is None:
            return None
        made = ModuleSpec(name, self, origin=found.origin, loader_state=found)
        made.submodule_search_locations = found.submodule_search_locations
        return made

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module of the folder."""
        return import_module(spec.loader_state.name)

    def exec_module(self, module: ModuleType) -> None:
        """Restore the module's specification, which the import system has replaced."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state

    def get_code(self, fullname: str) -> CodeType | None:
        """Return the code of a module that runs as a script (``python -m``)."""
        found = util.find_spec(fullname.partition(".")[2])
        assert found is not None
        assert isinstance(found.loader, InspectLoader)
        return found.loader.get_code(found.name)

    def get_source(self, fullname: str) -> str | None:
        """Return the source of a module."""
        found = util.find_spec(fullname.partition(".")[2])
        assert found is not None
        assert isinstance(found.loader, InspectLoader)
        return found.loader.get_source(found.name)


def install() -> None:
    """Add the names, once, if the folders are beside the package."""
    beside = all((PACKAGE.parent / folder / "__init__.py").is_file() for folder in FOLDERS)
    inside = any((PACKAGE / folder).exists() for folder in FOLDERS)
    if beside and not inside and not any(isinstance(one, Aliases) for one in sys.meta_path):
        sys.meta_path.insert(0, Aliases())


def catalogue() -> ModuleType:
    """Return the module of the controllers, loaded on use, since it builds on this package."""
    return import_module(f"{PACKAGE.name}.baselines.core.catalogue")

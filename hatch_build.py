"""Build of the wheel: the folders of the checkout become parts of the package ``pam_envs``.

The links of the README become absolute once ``repository`` is set in pyproject.toml.

``baselines``, ``agents`` and ``sweeps`` are names that other distributions use, too. The wheel
holds them as ``pam_envs.baselines`` and so on, with their imports and commands (``python -m``)
renamed. Pretrained policies are not included.
"""

import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

PACKAGE = "pam_envs"
FOLDERS = ("baselines", "agents", "sweeps")
SUFFIXES = (".py", ".yaml", ".json")
LEFT_OUT = ("pretrained",)
NAMES = "|".join(FOLDERS)
FROM = re.compile(rf"^(\s*from )({NAMES})(?=[.\s])", re.MULTILINE)
IMPORT = re.compile(rf"^(\s*)import ({NAMES})$", re.MULTILINE)
COMMAND = re.compile(rf"(?<=python -m )({NAMES})\b")
LINK = re.compile(r"(!?)\[([^\]]*)\]\((?![a-z]+:|#)([^)\s]+)\)")


def absolute(page: str, repository: str) -> str:
    """Return a page whose relative links lead to a repository; unchanged without one."""
    if not repository:
        return page

    def address(found: re.Match[str]) -> str:
        kind = "raw" if found[1] else "blob"
        return f"{found[1]}[{found[2]}]({repository.rstrip('/')}/{kind}/main/{found[3]})"

    return LINK.sub(address, page)


class CustomMetadataHook(MetadataHookInterface):
    """Read the README, and the address of the repository from the settings of the hook."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add readme and addresses."""
        repository: str = self.config["repository"]
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        page = {"content-type": "text/markdown", "text": absolute(text, repository)}
        metadata["readme"] = page
        metadata["urls"] = {"Repository": repository} if repository else {}


def renamed(source: str) -> str:
    """Return Python source whose imports and commands name the folders as parts of the package."""
    source = FROM.sub(rf"\1{PACKAGE}.\2", source)
    source = IMPORT.sub(rf"\1from {PACKAGE} import \2", source)
    return COMMAND.sub(rf"{PACKAGE}.\1", source)


class CustomBuildHook(BuildHookInterface):
    """Copy the folders with renamed imports into the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the renamed files; an editable install imports the folders as they are."""
        if version == "editable":
            return
        self.copies = Path(tempfile.mkdtemp())
        root = Path(self.root)
        for folder in FOLDERS:
            for file in sorted((root / folder).rglob("*")):
                place = file.relative_to(root)
                if file.suffix not in SUFFIXES or set(place.parts) & set(LEFT_OUT):
                    continue
                copy = self.copies / place
                copy.parent.mkdir(parents=True, exist_ok=True)
                text = file.read_text(encoding="utf-8")
                made = renamed(text) if file.suffix == ".py" else text
                copy.write_text(made, encoding="utf-8")
                build_data["force_include"][str(copy)] = f"{PACKAGE}/{place.as_posix()}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the copies."""
        if version != "editable":
            shutil.rmtree(self.copies)

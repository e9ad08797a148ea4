"""Shape of the source tree: sizes of folders, import circles."""

from collections import Counter
from pathlib import Path

import grimp
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("pam_envs", "sweeps", "baselines", "agents", "benchmarks")
MOST_MODULES = 15


def test_no_folder_holds_more_than_fifteen_modules() -> None:
    modules = [
        path
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if path.name != "__init__.py"
    ]
    sizes = Counter(str(path.parent.relative_to(ROOT)) for path in modules)
    assert {folder: n for folder, n in sizes.items() if n > MOST_MODULES} == {}


def test_imports_are_acyclic() -> None:
    graph = grimp.build_graph(*PACKAGES, cache_dir=None, exclude_type_checking_imports=True)
    names = sorted(graph.modules)
    row = {name: k for k, name in enumerate(names)}
    pairs = [(row[a], row[b]) for a in names for b in graph.find_modules_directly_imported_by(a)]
    importers, imported = np.array(pairs).T
    matrix = csr_array((np.ones(len(pairs)), (importers, imported)), shape=(len(names),) * 2)
    _, labels = connected_components(matrix, connection="strong")
    circles = [
        [names[k] for k in np.flatnonzero(labels == label)]
        for label, size in Counter(labels.tolist()).items()
        if size > 1
    ]
    assert circles == []


def test_randomize_has_one_spelling_in_the_code() -> None:
    """Only names of tracks have the other one, because rows are identified by them."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    found = [path for path in files if "randomis" in path.read_text("utf-8").lower()]
    assert found == [ROOT / "benchmarks/scenarios/kinds.py"]
    assert found[0].read_text("utf-8").lower().count("randomis") == 1

"""Files of a diagnosis: ``report.json``, ``report.html`` and ``plant.yaml``.

Every key of ``report.json`` is described in ``docs/diagnosis_report.md``. The same report gives the
same bytes: keys in a fixed order, numbers with six significant digits, ``null`` for values that are
not finite. Files are replaced atomically.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

SCHEMA = 1
"""Version of the layout of ``report.json``."""
DIGITS = 6
"""Significant digits of a number in ``report.json``."""
WIDTH = 100
"""Longest line for a list or an object."""

_KEYS = {
    "": "schema verdict text causes rivals noise_floor held_out error_before error_after "
    "residual_structure isolability experiment closed_loop closed_loop_reason calibration "
    "not_testable warnings rule_version provenance runtime_s",
    "causes": "name title form parameters gain effect size",
    "held_out": "by kinds share",
    "parameters": "name value unit interval neutral at_bound not_identified",
    "rivals": "name title form held_out gain behind judged why excluded",
    "judged": "gain better",
    "residual_structure": "before after",
    "r2": "direction rate pressure load time_since_reversal time temperature cycle",
    "peak": "frequency_hz ratio",
    "isolability": "names cosine absorbed",
    "experiment": "between name description segments separation enough sensor",
    "closed_loop": "controller where unit before after oracle better_percent recovered text",
    "calibration": "name unit before after interval at_bound not_identified outside_tolerance",
    "not_testable": "name reason",
    "provenance": "recording rig plant_before plant_after package seed",
    "*": "value unit from interval times_floor kinds contraction pressure "
    "ljung_box_p r2 flexible_r2 peak",
}
ORDER = {key: tuple(names.split()) for key, names in _KEYS.items()}
"""Order of the keys of an object, by the key of the object or of the list that contains it (``*``:
of all others); further keys follow in their given order."""


def plain(value: Any, key: str = "") -> Any:
    """Return nested values in plain JSON types: keys in order, numbers rounded, None if not finite.

    ``key`` is the key of the value, which selects the order of its own keys. Raises TypeError for
    any other type.
    """
    if isinstance(value, Mapping):
        first = ORDER.get(key, ORDER["*"])
        names = [k for k in first if k in value]
        names += [str(k) for k in value if k not in first]
        return {k: plain(value[k], k) for k in names}
    if isinstance(value, np.ndarray):
        return plain(value.tolist(), key)
    if isinstance(value, (list, tuple)):
        return [plain(v, key) for v in value]
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return rounded(float(value))
    if isinstance(value, Path):
        return str(value)
    raise TypeError(
        f"{key or 'the report'} holds {value!r} of type {type(value).__name__}; a report holds "
        "numbers, strings, booleans, None, lists and mappings of them"
    )


def rounded(value: float) -> float | None:
    """Return a number rounded to the digits of the report, or None if it is not finite."""
    if not math.isfinite(value):
        return None
    return float(f"{value:.{DIGITS}g}") + 0.0  # no negative zero


def dumps(value: Any, indent: int = 0) -> str:
    """Return JSON with lists and objects on one line where they fit."""
    short = json.dumps(value, allow_nan=False, ensure_ascii=False)
    if not isinstance(value, (dict, list)) or len(short) + indent <= WIDTH:
        return short
    inner = " " * (indent + 1)
    if isinstance(value, dict):
        rows = [
            f"{inner}{json.dumps(k, ensure_ascii=False)}: {dumps(v, indent + 1)}"
            for k, v in value.items()
        ]
        return "{\n" + ",\n".join(rows) + "\n" + " " * indent + "}"
    rows = [inner + dumps(v, indent + 1) for v in value]
    return "[\n" + ",\n".join(rows) + "\n" + " " * indent + "]"


def report_json(report: Mapping[str, Any]) -> str:
    """Return the text of ``report.json``."""
    return dumps(plain({"schema": SCHEMA, **report})) + "\n"


def write_file(path: Path, text: str) -> None:
    """Write a text file atomically."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with open(temporary, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write(diagnosis: Any, folder: Path) -> None:
    """Write a diagnosis into a folder, which is created if it is missing.

    Everything is drawn before the first file is replaced, so that a folder contains one diagnosis,
    never parts of two. A plant file or page of an earlier diagnosis is removed if this one has
    none: settled readings give no plant. Without matplotlib ``report.json`` and ``plant.yaml`` are
    written, the page is not, and ImportError is raised.
    """
    from pam_envs.diagnosis.report.page import page

    text = report_json(diagnosis.report)
    html, missing = None, None
    try:
        html = page(json.loads(text), diagnosis.traces)
    except ImportError as error:
        missing = error
    folder.mkdir(parents=True, exist_ok=True)
    for name, made in (("plant.yaml", diagnosis.plant), ("report.html", html)):
        if made is None:
            (folder / name).unlink(missing_ok=True)
    if diagnosis.plant is not None:
        diagnosis.plant.to_yaml(folder / "plant.yaml")
    if html is not None:
        write_file(folder / "report.html", html)
    write_file(folder / "report.json", text)
    if missing is not None:
        raise ImportError(
            f"report.json is in {folder}; the page report.html needs matplotlib, which is not "
            "installed: pip install 'pam-envs[plot]'"
        ) from missing

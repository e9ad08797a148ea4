"""Files of a diagnosis: ``report.json``, ``report.html`` and ``plant.yaml``.

Every key of ``report.json`` is described in ``docs/diagnosis_report.md``. The same report gives the
same bytes: numbers have six significant digits, values that are not finite are ``null``. The folder
is replaced atomically.
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.files import fresh_folder, write_text

FILES = ("report.json", "report.html", "plant.yaml")
SCHEMA = 1  # version of the layout of ``report.json``
DIGITS = 6  # significant digits of a number in ``report.json``
WIDTH = 100  # longest line for a list or an object


def plain(value: Any, key: str = "") -> Any:
    """Return nested values as JSON types, numbers rounded, None if not finite; else TypeError."""
    if isinstance(value, Mapping):
        return {str(k): plain(v, str(k)) for k, v in value.items()}
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


def write(diagnosis: Any, folder: Path) -> None:
    """Write a diagnosis into a folder, which is created if it is missing.

    The files are written into a new folder that then takes its place, so that it contains one
    diagnosis, never parts of two. A plant file or page of an earlier diagnosis is removed if this
    one has none: settled readings give no plant. Other files stay. Without matplotlib
    ``report.json`` and ``plant.yaml`` are written, the page is not, and ImportError is raised.
    """
    from pam_envs.diagnosis.report.page import page

    text = report_json(diagnosis.report)
    html, missing = None, None
    try:
        html = page(json.loads(text), diagnosis.traces)
    except ImportError as error:
        missing = error
    with fresh_folder(folder, FILES) as fresh:
        if diagnosis.plant is not None:
            diagnosis.plant.to_yaml(fresh / "plant.yaml")
        if html is not None:
            write_text(fresh / "report.html", html)
        write_text(fresh / "report.json", text)
    if missing is not None:
        raise ImportError(
            f"report.json is in {folder}; the page report.html needs matplotlib, which is not "
            "installed: pip install 'pam-envs[plot]'"
        ) from missing

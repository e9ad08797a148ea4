"""Example of a recording: a simulated rig with a hidden effect, its rig file, its sealed truth.

``python -m benchmarks example`` makes the three files. The truth is compressed, so that nobody
reads it before the diagnosis by accident.
"""

import base64
import hashlib
import json
import textwrap
import zlib
from pathlib import Path
from typing import Any

NAME = "example"
FOLDER = Path(__file__).parent
RECORDING, RIG, TRUTH = "example_recording.csv.gz", "example_rig.yaml", "example_truth.json"
WIDTH = 76  # characters of a line of the sealed text


def recording_and_rig(folder: Path = FOLDER) -> tuple[Path, Path]:
    """Return the files of the recording and of its rig."""
    return folder / RECORDING, folder / RIG


def sealed(truth: dict[str, Any], recording: bytes) -> str:
    """Return the text of the sealed file of a truth about a recording."""
    plain = json.dumps(truth, sort_keys=True).encode()
    content = {
        "open_with": f"pam-envs reveal {NAME}",
        "recording_sha256": hashlib.sha256(recording).hexdigest(),
        "truth_sha256": hashlib.sha256(plain).hexdigest(),
        "truth": textwrap.wrap(base64.b64encode(zlib.compress(plain, 9)).decode(), WIDTH),
    }
    return json.dumps(content, indent=1) + "\n"


def reveal(folder: Path = FOLDER) -> dict[str, Any]:
    """Open the sealed truth of the example.

    Returns
    -------
    dict
        ``names`` of the hidden effects in the catalogue of causes, their ``text`` in a sentence,
        the ``world`` of the rig, and ``rms_mm`` and ``rms_bar``, the change of both readings by
        the effects.

    Raises
    ------
    ValueError
        If the file was changed, or belongs to another recording.
    """
    where = folder / TRUTH
    content = json.loads(where.read_text(encoding="utf-8"))
    plain = zlib.decompress(base64.b64decode("".join(content["truth"])))
    recording = (folder / RECORDING).read_bytes()
    for what, data, key in (
        ("the truth", plain, "truth_sha256"),
        ("the recording", recording, "recording_sha256"),
    ):
        digest = hashlib.sha256(data).hexdigest()
        if digest != content[key]:
            raise ValueError(
                f"{where}: {what} has the digest {digest[:12]}, the file states "
                f"{content[key][:12]}; install the package again"
            )
    return dict(json.loads(plain))

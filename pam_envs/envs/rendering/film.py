"""Films of an environment, picture by picture."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def write_film(path: Path, pictures: Iterable[NDArray[np.uint8]], fps: int) -> None:
    """Write pictures of equal size to a ``.mp4`` or ``.gif`` file.

    Raises
    ------
    ImportError
        If imageio is not installed; says how to get it.
    """
    try:
        import imageio.v2 as imageio
    except ImportError as error:
        raise ImportError(
            'films need imageio, which is not installed: pip install "pam-envs[plot]"'
        ) from error
    settings: dict[str, Any] = {"fps": fps, "macro_block_size": 8}
    if path.suffix == ".gif":
        settings = {"duration": 1000.0 / fps, "loop": 0}
    film: Any = imageio.get_writer(path, **settings)
    try:
        for picture in pictures:
            film.append_data(picture)
    finally:
        film.close()

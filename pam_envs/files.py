"""Text files, written atomically."""

import os
from pathlib import Path


def write_text(path: Path, text: str) -> None:
    """Replace a text file atomically; an OSError names the file, which a full disk does not."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with open(temporary, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        temporary.unlink(missing_ok=True)

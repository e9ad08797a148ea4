"""How a command ends: by its exit code, and by one sentence where the user can mend something."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable


def answered(command: Callable[[], int | None], interrupted: str) -> int:
    """Run a command and return its exit code; a mistake is one sentence, no traceback.

    Parameters
    ----------
    command : callable
        Returns the exit code, or None for 0.
    interrupted : str
        What is said after Ctrl-C.
    """
    try:
        status = command()
        sys.stdout.flush()
    except ValueError as error:  # settings, rows, checkpoints and policy files say what to do
        return _told(f"error: {error}", 2)
    except BrokenPipeError:  # whoever read the output, like `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except OSError as error:
        place = f"{error.filename}: {error.strerror}; give another place"
        return _told(f"error: {place if error.filename else error}", 2)
    except KeyboardInterrupt:
        return _told(interrupted, 130)
    return int(status or 0)


def _told(sentence: str, status: int) -> int:
    print(sentence, file=sys.stderr)
    return status

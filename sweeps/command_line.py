"""Exit codes of the command lines, and one-sentence errors."""

import os
import sys
import threading
from collections.abc import Callable


def run_cli(command: Callable[[], int | None], interrupted: str) -> int:
    """Run a command and return its exit code, 0 for None; an error of the user is one sentence."""
    threading.excepthook = _in_thread
    try:
        status = command()
        sys.stdout.flush()
    except (
        ValueError
    ) as error:  # raised for settings, rows, checkpoints and policy files, with the remedy
        return _fail(f"error: {error}", 2)
    except BrokenPipeError:  # the process reading the output, such as `head`, has exited
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except OSError as error:
        place = f"{error.filename}: {error.strerror}; give another place"
        return _fail(f"error: {place if error.filename else error}", 2)
    except KeyboardInterrupt:
        return _fail(interrupted, 130)
    return int(status or 0)


def _in_thread(given: threading.ExceptHookArgs) -> None:
    """Report a full disk in a thread, such as that of a log, in a sentence."""
    if isinstance(given.exc_value, OSError):
        _fail(f"error: {given.exc_value}", 2)
    else:
        threading.__excepthook__(given)


def _fail(message: str, status: int) -> int:
    escaped = (c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in message)
    print("".join(escaped), file=sys.stderr)
    return status

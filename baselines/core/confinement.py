"""Process of a controller from outside the package, which may read its libraries and write nothing.

The file runs as a script and confines the process before it imports anything else: the kernel
(Landlock, Linux 5.13 or later) then refuses to open any other file, and, in later versions, TCP
connections and signals to other processes. On other systems the process is not confined.
"""

import ctypes
import json
import os
import struct
import sys
from collections.abc import Sequence

CREATE, ADD_RULE, RESTRICT = 444, 445, 446
"""System calls of Landlock, of the same number on all processors."""
EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1, 2, 4, 8
RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15}
"""Number of rights on files by version of Landlock; 16 in later ones."""
NO_NEW_PRIVILEGES = 38


def confine(files: Sequence[str], folders: Sequence[str]) -> bool:
    """Deny this process everything but reading ``files`` (deep) and listing ``folders``.

    Returns
    -------
    bool
        False where the system cannot do this.
    """
    if sys.platform != "linux":
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    version = libc.syscall(CREATE, None, ctypes.c_size_t(0), 1)
    if version < 1:
        return False
    denied = (1 << RIGHTS.get(version, 16)) - 1, 3, 3  # rights on files, TCP, signals and sockets
    size = 8 if version < 4 else 16 if version < 6 else 24
    rules = libc.syscall(CREATE, struct.pack("QQQ", *denied), ctypes.c_size_t(size), 0)
    read = EXECUTE | READ_FILE | READ_DIR
    allowed = [*((path, read) for path in files), *((path, READ_DIR) for path in folders)]
    for path, rights in (*allowed, (os.devnull, READ_FILE | WRITE_FILE)):
        if os.path.exists(path):
            place = os.open(path, os.O_PATH | os.O_CLOEXEC)
            kept = rights if os.path.isdir(path) else rights & ~READ_DIR
            libc.syscall(ADD_RULE, rules, 1, struct.pack("=Qi", kept, place), 0)
            os.close(place)
    libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    held = libc.syscall(RESTRICT, rules, 0) == 0
    os.close(rules)
    return held


if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    held = confine(given["files"], given["folders"])
    sys.path[:] = given["path"]
    from importlib import import_module

    import_module(given["module"]).serve(held)

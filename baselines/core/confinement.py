"""Process of a controller from outside the package, which may read its libraries and write nothing.

The file runs as a script and confines the process before it imports anything else. The kernel then
refuses to open any other file (Landlock, Linux 5.13 or later), and the system calls of ``DENIED``
(seccomp): sockets, new processes, and changes of other processes and of a file's permissions or
times. On other systems the process is not confined.
"""

import ctypes
import errno
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
NO_NEW_PRIVILEGES, SECCOMP, FILTER = 38, 22, 2

PROCESSORS = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
"""Processors by the number that the kernel gives to a filter of system calls."""
CLONE, CLONE3, LIMITS = (56, 220), (435, 435), (302, 261)
"""clone, of which threads are permitted; clone3; prlimit64, permitted for the process itself."""
DENIED = {
    # a socket in a folder needs no right to write there: a session bus would run any command
    "sockets": ((41, 53, 425), (198, 199, 425)),  # socket, socketpair, io_uring_setup
    "processes": ((57, 58), ()),  # fork, vfork
    # kill, tkill, tgkill, rt_sigqueueinfo, rt_tgsigqueueinfo, pidfd_send_signal
    "signals": ((62, 200, 234, 129, 297, 424), (129, 130, 131, 138, 240, 424)),
    # ptrace, process_vm_readv, process_vm_writev, setpriority, ioprio_set,
    # sched_setscheduler, sched_setparam, sched_setattr, sched_setaffinity
    "other processes": (
        (101, 310, 311, 141, 251, 144, 142, 314, 203),
        (117, 270, 271, 140, 30, 119, 118, 274, 122),
    ),
    # fchmod, fchmodat, fchmodat2, fchown, fchownat, utimensat, file_setattr; setxattr and
    # removexattr with their kinds; chmod, chown, lchown, utime, utimes, futimesat
    "properties of files": (
        (
            *(91, 268, 452, 93, 260, 280, 469, 188, 189, 190, 463, 197, 198, 199, 466),
            *(90, 92, 94, 132, 235, 261),
        ),
        (52, 53, 452, 55, 54, 88, 469, 5, 6, 7, 463, 14, 15, 16, 466),
    ),
    # shmget, shmat, shmctl, semget, semctl, msgget, msgctl, mq_open, mq_unlink,
    # keyctl, add_key, request_key
    "shared memory and keys": (
        (29, 30, 31, 64, 66, 68, 71, 240, 241, 250, 248, 249),
        (194, 196, 195, 190, 191, 186, 187, 180, 181, 219, 217, 218),
    ),
}
"""Denied system calls on each of ``PROCESSORS``."""
LOAD, EQUAL, ABOVE, MASK, RETURN = 0x20, 0x15, 0x35, 0x54, 0x06
"""Instructions of a filter."""
NUMBER, PROCESSOR, ARGUMENT = 0, 4, 16
"""Places of what a filter reads."""
ALLOW, REFUSE, KILL = 0x7FFF0000, 0x00050000, 0x80000000
THREAD = 0x10000
OTHER_NUMBERS = 0x40000000
"""First number of the second set of system calls of x86_64."""


def confine(files: Sequence[str], folders: Sequence[str]) -> bool:
    """Deny this process everything but reading ``files`` (deep) and listing ``folders``.

    Returns
    -------
    bool
        False where the system cannot do this.
    """
    processor = os.uname().machine if sys.platform == "linux" else ""
    if processor not in PROCESSORS or sys.maxsize < 2**32:
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    return _restrict_files(libc, files, folders) and _restrict_calls(libc, processor)


def _restrict_files(libc: ctypes.CDLL, files: Sequence[str], folders: Sequence[str]) -> bool:
    version = libc.syscall(CREATE, None, ctypes.c_size_t(0), 1)
    if version < 1:
        return False
    denied = (1 << RIGHTS.get(version, 16)) - 1
    rules = libc.syscall(CREATE, struct.pack("Q", denied), ctypes.c_size_t(8), 0)
    read = EXECUTE | READ_FILE | READ_DIR
    allowed = [*((path, read) for path in files), *((path, READ_DIR) for path in folders)]
    for path, rights in (*allowed, (os.devnull, READ_FILE | WRITE_FILE)):
        if os.path.exists(path):
            place = os.open(path, os.O_PATH | os.O_CLOEXEC)
            kept = rights if os.path.isdir(path) else rights & ~READ_DIR
            libc.syscall(ADD_RULE, rules, 1, struct.pack("=Qi", kept, place), 0)
            os.close(place)
    held = libc.syscall(RESTRICT, rules, 0) == 0
    os.close(rules)
    return held


def _restrict_calls(libc: ctypes.CDLL, processor: str) -> bool:
    k, refuse = list(PROCESSORS).index(processor), REFUSE | errno.EACCES
    denied = [number for numbers in DENIED.values() for number in numbers[k]]
    program = [
        *((LOAD, 0, 0, PROCESSOR), (EQUAL, 1, 0, PROCESSORS[processor]), (RETURN, 0, 0, KILL)),
        *((LOAD, 0, 0, NUMBER), (ABOVE, 0, 1, OTHER_NUMBERS), (RETURN, 0, 0, refuse)),
        *(step for n in denied for step in ((EQUAL, 0, 1, n), (RETURN, 0, 0, refuse))),
        # the C library then uses clone, whose flags a filter can read
        *((EQUAL, 0, 1, CLONE3[k]), (RETURN, 0, 0, REFUSE | errno.ENOSYS)),
        *((EQUAL, 0, 4, CLONE[k]), (LOAD, 0, 0, ARGUMENT), (MASK, 0, 0, THREAD)),
        *((EQUAL, 0, 4, THREAD), (RETURN, 0, 0, ALLOW)),
        *((EQUAL, 0, 3, LIMITS[k]), (LOAD, 0, 0, ARGUMENT), (EQUAL, 1, 0, 0)),
        *((RETURN, 0, 0, refuse), (RETURN, 0, 0, ALLOW)),
    ]
    code = b"".join(struct.pack("HBBI", *step) for step in program)
    held = ctypes.create_string_buffer(code, len(code))
    given = struct.pack("HP", len(program), ctypes.addressof(held))
    return bool(libc.prctl(SECCOMP, FILTER, ctypes.c_char_p(given), 0, 0) == 0)


if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    held = confine(given["files"], given["folders"])
    sys.path[:] = given["path"]
    from importlib import import_module

    import_module(given["module"]).serve(held)

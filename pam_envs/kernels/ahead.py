"""Compile one kernel into the cache: ``python -m pam_envs.kernels.ahead``, pickle on stdin."""

import lzma
import os
import pickle
import sys

from pam_envs.kernels import emission
from pam_envs.kernels.cache import FOLDER, make_folder, read_whole, write_whole
from pam_envs.kernels.machine_code import BUSY, Source, is_busy


def main() -> int:
    """Write IR and object code of a kernel; return the exit code."""
    if "--background" in sys.argv[1:] and hasattr(os, "nice"):
        os.nice(10)
    source: Source = pickle.load(sys.stdin.buffer)
    kernel = source.by_address
    make_folder(FOLDER)
    if not is_busy(kernel.busy_file):
        kernel.busy_file.unlink(missing_ok=True)
    try:
        kernel.busy_file.touch(exist_ok=False)
    except FileExistsError:
        return BUSY
    try:
        packed = read_whole(kernel.ir_file)
        if packed is not None:
            text = lzma.decompress(packed).decode()
        else:
            text = kernel.intermediate()
            write_whole(kernel.ir_file, lzma.compress(text.encode(), preset=6))
        write_whole(kernel.object_file(), emission.emit(text, emission.host()))
    finally:
        kernel.busy_file.unlink(missing_ok=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

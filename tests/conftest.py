"""Settings of all tests."""

import os

os.environ.setdefault("PAM_ENVS_COMPILE", "wait")  # tests compare machine code

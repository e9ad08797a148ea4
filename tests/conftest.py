"""Settings of all tests."""

import os

os.environ.setdefault("PAM_ENVS_COMPILE", "wait")  # machine code is compared, not awaited

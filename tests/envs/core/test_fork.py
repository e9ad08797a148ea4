"""Fork after a parallel batch: the child runs on one core, with the same results."""

import os
import subprocess
import sys

import pytest

from pam_envs.kernels.build import COMPILED

SCRIPT = """
import os, gymnasium as gym, numpy as np, pam_envs
envs = gym.make_vec("PAM/MusclePositioning-v0", 4096, vectorization_mode="vector_entry_point")
envs.reset(seed=0)
actions = np.zeros(envs.action_space.shape)
envs.step(actions)
state = envs.get_state()
expected = envs.step(actions)[0]
envs.set_state(state)
pid = os.fork()
if pid == 0:
    os._exit(0 if np.array_equal(envs.step(actions)[0], expected) else 1)
assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
assert np.array_equal(envs.step(actions)[0], expected)
"""


@pytest.mark.skipif(not COMPILED or not hasattr(os, "fork"), reason="no threads, or no fork")
def test_batch_steps_in_a_fork_with_the_same_bits() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr

"""Bits of the hysteresis operators, compiled and as plain Python."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

SCRIPT = """
import numpy as np
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.hysteresis.maxwell_slip import MaxwellSlip, PlayOperator
from pam_envs.hysteresis.modified_maxwell_slip import even_model
from pam_envs.kernels.build import COMPILED

def show(*arrays):
    print(*[float(v).hex() for array in arrays for v in np.ravel(array)])

print(COMPILED)
x = ((np.arange(400) * 7919) % 1009) / 450.0 - 1.1
for model in (
    PlayOperator((0.1, 0.7, 1.9), (0.3, 0.21, 0.4), 0.17),
    MaxwellSlip(0.13, (0.3, 0.21, 0.4), (0.1, 0.7, 1.9)),
):
    show(*model.simulate(1.8 * x))
for start in ("low", "virgin"):
    for depth in (5, 24):
        model = Preisach.from_density(lambda a, b: 1.0 + 0.3 * (a + b) ** 2, -1.0, 1.0, 12, depth)
        model = Preisach(-1.0, 1.0, model.plus_linear(0.3).table, depth, start)
        y, state = model.simulate(x)
        after, z = model.initial_state(), []
        for value in y:
            u, after = model.inverse_step(value, after)
            z.append(u)
        show(y, z, *state)
muscle = even_model(4.5e5, 7110.0, 0.5e5)
s = muscle.simulate(np.random.default_rng(5).uniform(-1e4, 5e5, 300))[0]
show(s, muscle.inverse_simulate(s)[0])
"""


def test_compiled_and_plain_python_agree_to_the_bit() -> None:
    outputs = []
    for compiled in "10":
        variables = os.environ | {"PAM_ENVS_COMPILE": compiled, "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", SCRIPT]
        done = subprocess.run(command, env=variables, capture_output=True, text=True, check=True)
        outputs.append(done.stdout.splitlines())
    assert (outputs[0][0], outputs[1][0]) == ("True", "False")
    assert len(outputs[0]) == 8
    assert outputs[0][1:] == outputs[1][1:]

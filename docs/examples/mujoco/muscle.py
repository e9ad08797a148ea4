"""A pneumatic muscle as an actuator of a MuJoCo model, through the exported C object.

pam-envs export muscle --target c --out .
cc -O2 -shared -fPIC muscle_c/muscle.c muscle_c/objects/x86_64-linux/muscle_kernel.o -o muscle.so
python muscle.py muscle.so
"""

import ctypes
import sys
from pathlib import Path

import mujoco
import numpy as np

STATE = 4096
"""Bytes for the state of a muscle: more than it needs."""
GRAVITY = 9.80665


class Muscle:
    """A muscle of the shared library: setpoint [Pa] and length [m] in, tension [N] out."""

    def __init__(self, library: str | Path) -> None:
        self._code = ctypes.CDLL(str(Path(library).resolve()))
        self._code.pam_muscle_output.restype = ctypes.c_double
        self._state = ctypes.create_string_buffer(STATE)
        self._code.pam_muscle_init(self._state)

    def reset(self, set_point: float, length: float) -> float:
        """Begin at rest under a pressure, free of friction; return the tension [N]."""
        self._code.pam_muscle_reset(self._state, (ctypes.c_double * 2)(set_point, length))
        return self._tension()

    def step(self, set_point: float, length: float) -> float:
        """Advance by one time step of the simulator; return the tension [N]."""
        self._code.pam_muscle_step(self._state, (ctypes.c_double * 2)(set_point, length))
        return self._tension()

    def _tension(self) -> float:
        return float(self._code.pam_muscle_output(self._state, 1))


def length_under(muscle: Muscle, weight: float) -> float:
    """Return the length [m] at which a muscle without pressure carries a weight [N]."""
    low, high = 0.08, 0.12
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if muscle.reset(0.0, middle) < weight else (low, middle)
    return low


def simulate(library: str | Path, set_points: np.ndarray) -> np.ndarray:
    """Return the lift of the load [m] after each setpoint [Pa], which is held for 10 ms."""
    model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_name("muscle.xml")))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    muscle = Muscle(library)
    start = length_under(muscle, model.body("load").mass[0] * GRAVITY)
    data.qpos[0] = data.ten_length[0] - start
    mujoco.mj_forward(model, data)
    muscle.reset(0.0, data.ten_length[0])
    lift = []
    for set_point in set_points:
        for _ in range(round(0.01 / model.opt.timestep)):
            data.ctrl[0] = muscle.step(set_point, data.ten_length[0])
            mujoco.mj_step(model, data)
        lift.append(start - (0.1 - data.qpos[0]))
    return np.array(lift)


if __name__ == "__main__":
    steps = np.repeat([0.0, 2e5, 4e5, 2e5], 150)  # Pa, 1.5 s each
    lift = simulate(sys.argv[1], steps)
    for k in range(149, len(steps), 150):
        print(f"{steps[k] / 1e5:.0f} bar: {1e3 * lift[k]:6.2f} mm")

"""One environment of a batch by one thread, with rows of neighbouring environments side by side.

The arrays have the shape (rows, N), so that neighbouring threads read neighbouring addresses. Step
and reset are separate kernels: each needs fewer registers than both together. Address books hold
the arrays of ``step_by_address`` with these shapes: state, parameters (N or 1 columns), integers,
previews (rows, N); tables, samples, settings and choices; actions (N, actions), observations
(1, N, signals), reports (1, 1 + keys, N), flags (3, N): terminated, truncated, either of them.

A launch takes the address of the book and the number of environments. On a GPU it is a grid of
threads, on a processor a loop over the environments.
"""

from dataclasses import dataclass
from typing import Any

from pam_envs.envs.core.step import (
    EPISODE,
    N_WORK_ROWS,
    STEP,
    env_advance,
    env_apply,
    env_evaluate,
    extend_preview,
    reset_lane,
    take_actions,
    write_common,
    write_lane,
    write_tile,
)
from pam_envs.kernels.build import array_at, kernel, lane_view, scratch
from pam_envs.kernels.emission import Target
from pam_envs.kernels.intermediate import ENTRY
from pam_envs.kernels.machine_code import AddressKernel, emitted, intermediate_of


@kernel
def step_lane(book: Any, lane: int) -> None:
    """Step one environment of a batch."""
    rows = lane_view(array_at(book, 0, 2, 0), lane)
    fixed = lane_view(array_at(book, 1, 2, 0), lane)
    counts = lane_view(array_at(book, 2, 2, 1), lane)
    ahead = lane_view(array_at(book, 3, 2, 0), lane)
    tables, samples = array_at(book, 4, 3, 0), array_at(book, 5, 2, 0)
    settings, choices = array_at(book, 6, 2, 0), array_at(book, 7, 1, 1)
    observation, info = array_at(book, 9, 3, 2)[0], array_at(book, 10, 3, 0)[0]
    work = scratch(N_WORK_ROWS, 1)
    take_actions(rows, settings, choices, work, array_at(book, 8, 2, 0), lane)
    env_apply(rows, fixed, counts, settings, choices, work)
    env_advance(rows, fixed, counts, tables, samples, settings, choices, work)
    counts[STEP][0] = counts[STEP][0] + 1
    extend_preview(rows, fixed, counts, ahead, samples, settings, choices)
    write_common(rows, counts, ahead, settings, choices, work)
    env_evaluate(rows, fixed, counts, settings, choices, work)
    write_tile(work, settings, choices, observation, info, array_at(book, 11, 2, 3), lane, 1)


@kernel
def restart_lane(book: Any, lane: int) -> None:
    """Start an episode of one environment of a batch, if one of its flags is set.

    It is the next episode, or after ``flags[0] = 2`` the one that the counter gives.
    """
    flags = array_at(book, 11, 2, 3)
    flags[2][lane] = 1 if flags[0][lane] + flags[1][lane] > 0 else 0
    if flags[2][lane] > 0:
        rows = lane_view(array_at(book, 0, 2, 0), lane)
        fixed = lane_view(array_at(book, 1, 2, 0), lane)
        counts = lane_view(array_at(book, 2, 2, 1), lane)
        ahead = lane_view(array_at(book, 3, 2, 0), lane)
        tables, samples = array_at(book, 4, 3, 0), array_at(book, 5, 2, 0)
        settings, choices = array_at(book, 6, 2, 0), array_at(book, 7, 1, 1)
        observation, info = array_at(book, 9, 3, 2)[0], array_at(book, 10, 3, 0)[0]
        work = scratch(N_WORK_ROWS, 1)
        if flags[0][lane] < 2:
            counts[EPISODE][0] = counts[EPISODE][0] + 1
        reset_lane(rows, fixed, counts, ahead, tables, samples, settings, choices, work, 0)
        write_common(rows, counts, ahead, settings, choices, work)
        env_evaluate(rows, fixed, counts, settings, choices, work)
        write_lane(work, settings, choices, observation, info, lane, 0)


PARTS = {"step": step_lane, "restart": restart_lane}
UNREACHED = {"FAR": 1e38, "EVERYTHING": 1e38}
"""Numbers beyond any input of a hysteresis model, within the range of float32."""
ARCHITECTURE = "sm_80"
"""Oldest architecture for which PTX is emitted; drivers compile it for newer ones."""
REGISTERS = {"step": 128}
"""Most registers of a thread: with fewer than the compiler takes, more threads run at once."""
_LANE = "pam_lane"
_GRID = """
declare i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.tid.x()
define ptx_kernel void @{name}(ptr %book, i64 %number) {{
  %block = call i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
  %size = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %thread = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
  %wide_block = zext i32 %block to i64
  %wide_size = zext i32 %size to i64
  %wide_thread = zext i32 %thread to i64
  %first = mul i64 %wide_block, %wide_size
  %lane = add i64 %first, %wide_thread
  %inside = icmp slt i64 %lane, %number
  br i1 %inside, label %run, label %done
run:
  call void @{lane}(ptr %book, i64 %lane)
  br label %done
done:
  ret void
}}
"""
_LIMIT = """
!nvvm.annotations = !{{!999999}}
!999999 = !{{ptr @{name}, !"maxnreg", i32 {registers}}}
"""  # LLVM 20 ignores the attribute "nvvm.maxnreg"
_LOOP = """
define void @{name}(ptr %book, i64 %number) {{
begin:
  br label %head
head:
  %lane = phi i64 [ 0, %begin ], [ %next, %run ]
  %inside = icmp slt i64 %lane, %number
  br i1 %inside, label %run, label %done
run:
  call void @{lane}(ptr %book, i64 %lane)
  %next = add i64 %lane, 1
  br label %head
done:
  ret void
}}
"""


@dataclass(frozen=True)
class LaneKernel:
    """Kernel of one environment of a batch in the layout (rows, N).

    Parameters
    ----------
    kernels : Kernels
        Kernels of a family of environments.
    part : {"step", "restart"}
        Part of a control period.
    dtype : {"float64", "float32"}
        Type of all numbers that are neither integers nor observations.
    """

    kernels: Any
    part: str
    dtype: str = "float64"

    @property
    def by_address(self) -> AddressKernel:
        """The kernel that takes an address book and a lane."""
        single = self.kernels.by_address
        name = f"{self.part}_lane_{single.name.removeprefix('single_')}"
        if self.dtype == "float64":
            return AddressKernel(name, PARTS[self.part], single.names, single.words)
        names = {**single.names, **UNREACHED}
        return AddressKernel(
            f"{name}_{self.dtype}", PARTS[self.part], names, single.words, self.dtype
        )

    def ptx(self, name: str, architecture: str = ARCHITECTURE) -> bytes:
        """Return PTX with one kernel, ``name(int64_t *book, int64_t number)``."""
        target = Target("nvptx64-nvidia-cuda", architecture)
        text = self._launched(_GRID, name)
        if self.part in REGISTERS:
            text += _LIMIT.format(name=name, registers=REGISTERS[self.part])
        return emitted(text, target, assembly=True)

    def object_code(self, target: Target) -> bytes:
        """Return object code for a processor, with the loop over environments as its entry."""
        return emitted(self._launched(_LOOP, ENTRY), target)

    def _launched(self, launch: str, name: str) -> str:
        """Return the LLVM IR with one public function, the launch."""
        text = intermediate_of(self).replace(f"@{ENTRY}(", f"@{_LANE}(")
        text = text.replace(f"define void @{_LANE}(", f"define internal void @{_LANE}(")
        return text + launch.format(name=name, lane=_LANE)

"""Command ``export-controller``: artefacts by name, and refusals."""

from pathlib import Path

import pytest

from benchmarks.__main__ import main
from pam_envs.kernels.build import COMPILED

MUSCLE = "MusclePositioning"


def test_structured_text_is_written_by_name(tmp_path: Path) -> None:
    arguments = ["export-controller", "plc_refitted", "--env", MUSCLE, "--target", "st"]
    assert main([*arguments, "--out", str(tmp_path)]) == 0
    text = (tmp_path / "plc_refitted_st" / "plc_refitted.st").read_text()
    assert "FUNCTION_BLOCK FB_PlcRefitted" in text


@pytest.mark.skipif(not COMPILED, reason="the kernels are compiled")
def test_controller_in_si_names_units_and_agreement(tmp_path: Path) -> None:
    arguments = ["export-controller", "pid", "--env", MUSCLE, "--si", "--out", str(tmp_path)]
    assert main(arguments) == 0
    header = (tmp_path / "pid_c" / "pid.h").read_text()
    assert "/* contraction [m], -0.01 .. 0.02 */" in header
    assert "/* action.pressure_set_point [Pa], 0 .. 600000 */" in header
    readme = (tmp_path / "pid_c" / "README.md").read_text()
    assert "equal to those of the Python controller to the last bit" in readme
    assert "Parameters" not in readme


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["pid", "--env", "KneeWalk"], "pid is for PAM/MusclePositioning-v0, not for PAM/KneeWalk"),
        (["pidd", "--env", MUSCLE], "no controller named 'pidd'"),
        (["pid", "--env", "Muscle"], "no environment or plant named 'Muscle'"),
        (["inverse", "--env", MUSCLE, "--target", "st"], "cannot be written in Structured Text"),
        (["table", "--env", MUSCLE], "cannot be exported"),
    ],
)
def test_refusals_name_the_reason(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export-controller", *arguments, "--out", str(tmp_path)]) != 0
    assert message in capsys.readouterr().err

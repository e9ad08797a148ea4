"""Progress of a diagnosis."""

import re

import pytest

from pam_envs.diagnosis.report.outcome import steps


@pytest.mark.parametrize("shown", [True, False])
def test_stages_are_printed_with_the_time_if_asked(shown, capsys):
    with steps(shown) as step:
        step("checking the data")
        step("refitting the plant")
    printed = capsys.readouterr()
    assert printed.out == ""
    lines = re.findall(r"^0:00  (.*)$", printed.err, re.MULTILINE)
    assert lines == (["checking the data", "refitting the plant"] if shown else [])

"""Reports of progress where standard error is not a terminal."""

import pytest

from spin_usd.terminal.progress import shown


def test_a_line_says_what_it_counts_and_none_is_said_twice(capsys: pytest.CaptureFixture[str]) -> None:
    with shown() as progress:
        for done in (0, 9, 18, 18):
            progress("planning: picture", done, 18)
        progress("rendering: picture", 18, 18)
    assert capsys.readouterr().err.splitlines() == [
        "planning: picture 0 of 18",
        "planning: picture 18 of 18",
        "rendering: picture 18 of 18",
    ]

"""Files that are written whole, and tables that a spreadsheet may open."""

import csv
import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chutelab.util.files import csv_lines, harmless, unquoted

STARTS = tuple("=+-@＝＋－＠")


def is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("=1+1", "'=1+1"), ("@SUM(A1:A9)", "'@SUM(A1:A9)"), ("+1+1", "'+1+1"), ("-1-1", "'-1-1"),
        ("-2*cmd|' /C calc'!A0", "'-2*cmd|' /C calc'!A0"), ("a;=1+1;b", "a;'=1+1;b"),
        ("\t=1+1", "\t'=1+1"), ("a\r\n =1+1", "a\r\n '=1+1"), ('a;"=1+1;', "a;\"'=1+1;"),
        ("＝1+1", "'＝1+1"), ("'=1+1", "''=1+1"),
        ("a=b, x+y - 3; see a@b", "a=b, x+y - 3; see a@b"),
        *((text, text) for text in ("", "plate", "-0.5", "+1e-9", "-inf", "1;2")),
    ],
)  # fmt: skip
def test_no_text_is_a_formula(text, cell):
    assert harmless(text) == cell
    assert unquoted(cell) == text


@given(st.text(alphabet=st.sampled_from("=+-@;\t\r\n \"',a1.＝"), max_size=12))
def test_whatever_separates_the_cells_none_begins_as_a_formula_and_all_come_back(text):
    line = "".join(csv_lines([[text, "after"]]))
    ((cell, _),) = csv.reader(io.StringIO(line, newline=""))
    assert unquoted(cell) == text
    if is_number(text):
        assert cell == text
    else:
        assert not any(part.lstrip(' "').startswith(STARTS) for part in re.split("[;\t\r\n]", line))

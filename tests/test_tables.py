import math

import pytest

from chutelab.theory import table

G = 9.81


def half_unit(printed):
    return 0.5 * 10.0 ** -len(printed.partition(".")[2])


@pytest.mark.parametrize(("number", "rows", "cells"), [(1, 22, 88), (4, 11, 66), (5, 11, 66)])
def test_every_printed_digit_comes_out_of_the_printed_equations(number, rows, cells):
    found = table(number)
    assert (len(found.rows), found.cells, found.differing) == (rows, cells, 0)
    for row in found.rows:
        for cell in row.cells:
            assert abs(cell.computed - float(cell.printed)) <= half_unit(cell.printed) + 1e-12
            assert cell.rounded == cell.printed


def test_only_x3_of_table_1_depends_on_equation_9():
    found = table(1, rebound="corrected")
    assert found.differing == 22
    assert all([cell.differs for cell in row.cells] == [False, False, True, False]
               for row in found.rows)  # fmt: skip
    assert found.rows[0].cells[2].rounded == "0.146"
    assert found.rows[11].cells[2].rounded == "0.420"
    assert [table(number, rebound="corrected").differing for number in (4, 5)] == [0, 0]


def test_table_3_is_refuted_not_fitted():
    found = table(3)
    assert (found.cells, found.differing) == (4, 4)
    # A 0.26 kg point from a flat belt, 0.5 m to the plate: E = m/2 (v0² + (g 0.5/v0)²), in mJ
    for row, speed in zip(found.rows, (2.0, 4.0), strict=True):
        energy = 130.0 * (speed**2 + (G * 0.5 / speed) ** 2)
        assert row.cells[0].computed == pytest.approx(energy, rel=1e-14, abs=0.0)
        assert float(row.cells[0].printed) > 13.0 * energy
    text = " ".join(found.notes)
    assert "17,675 N mm" in text
    assert "11.7 m/s" in text
    # m g h, from the plate to the support at 4 m/s
    assert f"fall {(93.56914 - 34.84660) / (0.26 * G):.1f} m from the plate" in text
    assert "fall 23.0 m" in text
    assert math.sqrt(2 * 17.67536 / 0.26) == pytest.approx(11.66, abs=0.005)

"""References of sheets in their plane, by a code that shares nothing with shellmb."""

import numpy as np
import pytest

from shellmb.demos.verification.problems.elements import plane
from tests.verify.plane_stress import Array, Sheet


def of_sides(sheet: Sheet, at: Array) -> Array:
    return np.stack([at, at], axis=1)


def rectangle(length: float, height: float):
    return lambda xi, eta: np.stack([length * xi, height * eta], axis=1)


def quarter(inner: float, outer: float):
    def place(xi: Array, eta: Array) -> Array:
        r, a = inner + (outer - inner) * eta, np.pi / 2 * xi
        return np.stack([r * np.sin(a), -r * np.cos(a)], axis=1)

    return place


def test_a_sheet_with_a_force_at_a_node_and_on_pins() -> None:
    sheet = Sheet(rectangle(2, 1), (4, 2), levels=4)
    ends = [np.abs(sheet.x[:, 0] - end) < 1e-12 for end in (0.0, 2.0)]
    force = np.zeros_like(sheet.x)
    force[sheet.at(2, 0.5)] = 0, 1
    u = sheet.solve(force, of_sides(sheet, ends[0]))[:, 1]
    found = u[sheet.at(1, 0)], u[sheet.at(2, 0)]
    assert found == pytest.approx((plane.HALF_WAY, plane.CORNER), rel=1e-4)
    corners = np.zeros(sheet.x.shape, dtype=bool)
    corners[sheet.at(0, 0)] = True
    corners[sheet.at(2, 0), 1] = True
    u = sheet.solve(sheet.side(sheet.x[:, 1] > 1 - 1e-12, (0, -2)), corners)[:, 1]
    assert u[sheet.at(1, 1)] - u[sheet.at(1, 0)] == pytest.approx(plane.SHORTER, rel=1e-4)


def test_a_force_over_an_eighth_of_a_side() -> None:
    sheet = Sheet(rectangle(2, 1), (8, 16), levels=2)
    force = sheet.side(sheet.x[:, 0] > 2 - 1e-12, (0, 1), (7 / 16, 9 / 16))
    u = sheet.solve(force, of_sides(sheet, sheet.x[:, 0] < 1e-12))
    assert np.sum(force * u) == pytest.approx(plane.AT_THE_FORCE, rel=1e-4)


@pytest.mark.parametrize(
    ("place", "cells", "nu", "end", "force", "at", "wanted"),
    [
        (rectangle(0.5, 0.1), (10, 2), 0.3, 1, (1, 0), (0.5, 0.05), 5 * plane.PULLED),
        (quarter(0.1, 0.5), (4, 4), 0.3, 1, (1, 0), (0.3, 0.0), plane.RING),
        (quarter(4.12, 4.32), (24, 2), 0.25, 0, (0, 1), (0.0, -4.22), 1e6 * plane.CURVED),
        (
            lambda xi, eta: np.stack([48 * xi, 44 * xi + eta * (44 - 28 * xi)], axis=1),
            (4, 4),
            1 / 3,
            1,
            (0, 1),
            (48, 52),
            plane.COOK,
        ),
    ],
)
def test_one_end_held_and_a_force_along_the_other(place, cells, nu, end, force, at, wanted) -> None:
    sheet = Sheet(place, cells, nu, levels=4)
    free, held = (np.abs(sheet.xi - e) < 1e-12 for e in (end, 1 - end))
    u = sheet.solve(sheet.side(free, force), of_sides(sheet, held))
    along = int(np.argmax(np.abs(force)))
    assert u[sheet.at(*at), along] == pytest.approx(wanted, rel=1e-4)

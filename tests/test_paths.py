"""Values and limits at the full paths of a scene's keys."""

import numpy as np
import pytest

from chutelab.scene import MISSING, load
from chutelab.scene.overrides import limits_of, parts_of, rule_at, value_at


@pytest.mark.parametrize(
    ("path", "limits"),
    [
        ("gravity", (0.0, 1e6)),
        ("plate.restitution", (0.0, 1.0)),
        ("plate.angle_deg", (np.nextafter(-90.0, 0.0), np.nextafter(90.0, 0.0))),
        ("stream.at[0]", (-1e6, 1e6)),
        ("surface[3].points[2][1]", (-1e6, 1e6)),
        ("stream.count", None),
        ("title", None),
    ],
)
def test_limits_are_those_of_the_validation(path, limits):
    assert limits_of(rule_at(parts_of(path))) == limits


@pytest.mark.parametrize("path", ["plate.angle", "stream.at[0].x", "hood"])
def test_paths_that_lead_nowhere(path):
    assert rule_at(parts_of(path)) is None
    assert value_at(load("perpendicular"), path) is MISSING


def test_values_have_defaults_filled_in():
    scene = load("perpendicular", ["plate.angle_deg=0", "stream.at=[-1, 2]"])
    assert scene.plate is not None
    assert value_at(scene, "plate.restitution") == scene.plate.restitution
    assert value_at(scene, "plate.pivot_height") == scene.incoming.pulley_radius
    assert value_at(scene, "stream.at[1]") == 2.0
    assert value_at(scene, "stream.velocity") is None

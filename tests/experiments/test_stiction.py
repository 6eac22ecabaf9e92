"""The command behind the table of docs/accuracy.md."""

from __future__ import annotations

import pytest

pytest.importorskip("mujoco")

from experiments import stiction

RECIPE = "elliptic, impratio 10"


@pytest.mark.parametrize("who", ["plane", "3D"])
def test_what_coulomb_friction_holds_rests_here_and_what_it_does_not_hold_slides(who):
    for case in (stiction.straight(0.999), stiction.braced()):
        assert stiction.creep(who, case) < 1e-9
    assert stiction.moved(who, stiction.resting(), 60.0) < 1e-12
    assert stiction.sliding(who, stiction.straight(1.001)) == pytest.approx(1.0, abs=1e-6)


def test_mujoco_s_creep_is_inversely_proportional_to_impratio():
    creeps = [stiction.creep(who, stiction.straight(0.5)) for who in (RECIPE, "elliptic, impratio 1000")]
    assert creeps == [pytest.approx(33.5, rel=0.05), pytest.approx(0.335, rel=0.05)]


def test_the_capsule_sinks_as_in_the_report_of_mujoco_s_users():
    """155 um/s with the recipe; over 1500 um/s with the defaults."""
    defaults, recipe = (stiction.SETTINGS[who] for who in ("MuJoCo, default contacts", RECIPE))
    assert stiction.pinched(recipe) == pytest.approx(155.0, rel=0.05)
    assert stiction.pinched(defaults) > 1500.0

"""What is simulated, and how "as printed" is meant for each experiment."""

import pytest

from snake_env import Integrator, _native
from snake_env.reproduce.experiment import TABLE_7_2, Runs
from snake_env.reproduce.experiments import experiments

IMPLICIT = ("solved", "implicit", "arctan", "ellipse", "PD high, set-valued", "slow", "viscous", "sign")
"""What the thesis's scheme is not meant for: the other side of a comparison, smooth friction, high gains; nor has it
free play, broken joints or obstacles of finite height."""


def test_table_7_2_is_the_scheme_of_the_thesis():
    assert Integrator(method="thesis") == TABLE_7_2
    printed = _native.defaults("thesis_integrator")
    assert (printed["r_h"], printed["r_n"], printed["r_v"]) == (0.01, 0.1, 0.05)
    assert TABLE_7_2.step is TABLE_7_2.tolerance is TABLE_7_2.r_t is None, "each model has its own column"


@pytest.mark.parametrize("name", experiments())
def test_as_printed_means_what_the_section_prescribes(name):
    printed = experiments()[name].printed
    if name in ("drop", "drop, as printed"):
        assert printed == Integrator(method="thesis", r_n=0.01), "7.3.1: r_N = 0.01"
    elif name.endswith(IMPLICIT) or name.startswith(("free play", "as built", "broken", "stairs", "flat drop")):
        assert printed.method == "implicit"
    else:
        assert printed == TABLE_7_2


def test_the_method_chooses_the_integrator(monkeypatch):
    taken = []
    monkeypatch.setattr("snake_env.reproduce.experiment.simulate", lambda **given: taken.append(given["integrator"]))
    for method in ("implicit", "thesis"):
        Runs(experiments(), method)["drop"]
    assert taken == [Integrator(step=1e-3), Integrator(method="thesis", r_n=0.01)]


def test_an_experiment_is_simulated_once():
    runs = Runs(experiments(), sample=0.5)
    assert runs["free"] is runs["free"]

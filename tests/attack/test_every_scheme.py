"""Every bundled scene with every scheme that it can have: one step, and its results."""

from types import SimpleNamespace

from mpi4py import MPI

import numpy as np
import pandas as pd
import pytest

from shellmb.demos import tumbling_plate
from shellmb.errors import SceneError, ShellmbError
from shellmb.running.execute import execute
from shellmb.running.loader import demos, load
from shellmb.running.request import Options
from shellmb.running.results import measured
from shellmb.schemes.registry import SCHEMES

# kernels of rigid bodies and beams compile in seconds, those of shells in up to a minute
QUICK = {"heavy_top", "slider_crank", "spin_up_beam"}


def cases():
    for name in demos():
        for scheme in SCHEMES:
            marks = [] if name in QUICK else [pytest.mark.slow]
            yield pytest.param(name, scheme, marks=marks, id=f"{name}-{scheme}")


def with_scheme(name: str, scheme: str):
    """The scene with one step, or what refuses it."""
    module = load(name)
    scene = module.build()
    chosen = Options(scheme=scheme).apply(scene)
    return Options(t_end=chosen.dt).apply(chosen), module


@pytest.mark.parametrize("scheme", list(SCHEMES))
@pytest.mark.parametrize("name", list(demos()))
def test_a_scheme_is_possible_or_refused_in_a_sentence(name: str, scheme: str) -> None:
    try:
        scene, _ = with_scheme(name, scheme)
    except SceneError as refused:
        named = (f"scheme '{scheme}'", f"scheme is '{scheme}'")
        said = ("mass per area", "nothing supports it", "be a dynamic one", *named)
        assert any(words in str(refused) for words in said)
        # never the scheme that the scene itself names
        assert load(name).build().scheme_name != scheme
    else:
        assert scene.scheme_name == scheme


@pytest.mark.parametrize(("name", "scheme"), list(cases()))
def test_one_step_and_results(name: str, scheme: str) -> None:
    try:
        scene, module = with_scheme(name, scheme)
    except SceneError:
        pytest.skip("not possible, see above")
    try:
        done = execute(scene, pictures=False, results=module.results)
    except ShellmbError:
        # a mechanism that is made to move has no equilibrium under its loads
        assert scene.static and not module.build().static
        return
    assert done.simulation.step >= 1
    assert all(np.isfinite(value) for value in done.results.values())


def test_results_that_a_scheme_does_not_have_are_left_out() -> None:
    """`shellmb run tumbling_plate --scheme ed`: ED keeps no momenta."""
    summary = {"energy_balance_error": 1e-12, "director_max": 1e-15}
    summary |= {"linear_momentum_drift": None, "angular_momentum_drift": None}
    run = SimpleNamespace(summary=summary, history=pd.DataFrame({"t": [0.0]}))
    found = measured(tumbling_plate.results, run, MPI.COMM_WORLD)
    assert found == {"energy_balance_error": 1e-12, "director_max": 1e-15}

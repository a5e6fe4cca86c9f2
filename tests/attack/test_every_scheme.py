"""Every bundled scene with every scheme that it can have: one step, and its results."""

from types import SimpleNamespace

from mpi4py import MPI

import numpy as np
import pandas as pd
import pytest

from shellmb.demos import tumbling_plate
from shellmb.errors import SceneError, ShellmbError
from shellmb.options.run import Options
from shellmb.running.execute import execute
from shellmb.running.loader import demos, load
from shellmb.running.results import measured
from shellmb.scene import Scene
from shellmb.schemes.registry import SCHEMES

# kernels of rigid bodies and beams compile in seconds, those of shells in up to a minute
QUICK = {"heavy_top", "slider_crank", "spin_up_beam"}


def cases():
    for name in demos():
        for scheme in SCHEMES:
            marks = [] if name in QUICK else [pytest.mark.slow]
            yield pytest.param(name, scheme, marks=marks, id=f"{name}-{scheme}")


def one_step(scene: Scene, scheme: str) -> Scene:
    """The scene with one step of another scheme, or what refuses it."""
    chosen = Options(scheme=scheme).apply(scene)
    return Options(t_end=chosen.dt).apply(chosen)


def test_a_scheme_is_possible_or_refused_in_a_sentence() -> None:
    found = []
    for name in demos():
        module = load(name)
        scene = module.build()
        for scheme in SCHEMES:
            try:
                right = one_step(scene, scheme).scheme_name == scheme
            except SceneError as refused:
                named = (f"scheme '{scheme}'", f"scheme is '{scheme}'")
                said = ("mass per area", "nothing supports it", "be a dynamic one", *named)
                right = any(words in str(refused) for words in said)
                # never the scheme that the scene itself names
                right = right and scene.scheme_name != scheme
            if not right:
                found.append((name, scheme))
    assert found == []


@pytest.mark.parametrize(("name", "scheme"), list(cases()))
def test_one_step_and_results(name: str, scheme: str) -> None:
    module = load(name)
    try:
        scene = one_step(module.build(), scheme)
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

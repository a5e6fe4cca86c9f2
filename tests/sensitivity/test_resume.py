"""A run with derivatives that was stopped goes on, with the scenes beside it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import shellmb as sm
from shellmb.api.sensitivity.run import sensitivities
from shellmb.sensitivity.tangent import Tangents
from tests.sensitivity import scenes

BY = ("thickness", "force")


class Stop(Exception):
    """What stops a run."""


def stopped_at(
    step: int,
    out: Path,
    patch: pytest.MonkeyPatch,
    columns: str,
    make: Callable[..., sm.Scene] = scenes.plate,
    by: tuple[str, ...] = BY,
    values: dict | None = None,
) -> None:
    """A run with derivatives that ends in its step after some steps."""
    solved = Tangents.solved

    def fail(self: Tangents, simulation: object) -> None:
        if simulation.step == step:  # type: ignore[attr-defined]
            raise Stop
        solved(self, simulation)  # type: ignore[arg-type]

    with patch.context() as patched:
        patched.setattr(Tangents, "solved", fail)
        with pytest.raises(Stop):
            sensitivities(make, by, out, columns=columns, values=values)


@pytest.mark.parametrize("columns", ["all", pytest.param("probes", marks=pytest.mark.slow)])
def test_it_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, columns: str) -> None:
    """The run is the run bit for bit; derivatives are solved to 1e-8 from another first guess."""
    whole = sm.sensitivities(scenes.plate, BY, tmp_path / "whole", columns=columns)
    out = tmp_path / "stopped"
    stopped_at(2, out, monkeypatch, columns)
    with pytest.raises(sm.SceneError, match="did not come to its end"):
        sm.Sensitivities(out)
    found = sm.sensitivities(scenes.plate, BY, out, columns=columns, resume=True)
    pd.testing.assert_frame_equal(
        found.run.history.drop(columns="wall_s"),
        whole.run.history.drop(columns="wall_s"),
        check_exact=True,
    )
    assert len(found.history) == len(whole.history) == 5
    for name in BY:
        one, other = found.history[name], whole.history[name]
        sizes = other.abs().max()
        # round-off of accounts is nothing that derivatives are known of
        real = [c for c in other if sizes[c] > 1e-6 * sizes.max() and "error" not in c]
        assert "tip" in real
        off = (one[real] - other[real]).abs().max() / sizes[real]
        assert off.max() < 1e-6, off.idxmax()
    if columns == "all":
        one, other = (s.fields["force"]["strip"].displacement for s in (found, whole))
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-6 * float(np.abs(other).max()))


def test_what_does_not_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(sm.SceneError, match="in which no run with derivatives was begun"):
        sm.sensitivities(scenes.plate, BY, tmp_path / "nothing", resume=True)
    out = tmp_path / "stopped"
    stopped_at(1, out, monkeypatch, "probes")
    with pytest.raises(sm.SceneError, match=r"was begun; give another .* by resume=True"):
        sm.sensitivities(scenes.plate, BY, out, columns="probes")
    more = {"columns": "probes", "resume": True}
    with pytest.raises(sm.SceneError, match="the state is not of the scene 'plate' as it is now"):
        sm.sensitivities(scenes.plate, BY, out, values={"E": 70e9}, **more)
    with pytest.raises(sm.SceneError, match="cannot be read"):
        sm.sensitivities(scenes.plate, (*BY, "E"), out, **more)

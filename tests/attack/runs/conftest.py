"""One small run, made once, and copies of it to be spoilt."""

import shutil
from pathlib import Path

import pytest

from shellmb.errors import Stopped
from shellmb.running.execute import execute
from shellmb.running.request import Request
from shellmb.simulate.simulation import BaseObserver

SCENE = Path(__file__).with_name("scene_pendulum.py")
# the state is that of the step before
STOPPED_AT = 3


class StopAt(BaseObserver):
    """Ends a run behind a step, as a signal does."""

    def accepted(self, simulation) -> None:
        if simulation.step == STOPPED_AT:
            raise Stopped(15)


@pytest.fixture(name="made", scope="session")
def make(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run directory of a run that was stopped in the middle."""
    out = tmp_path_factory.mktemp("made") / "run"
    request = Request(str(SCENE))
    scene, module = request.build()
    with pytest.raises(Stopped):
        execute(scene, out, [StopAt()], pictures=False, request=request, results=module.results)
    return out


@pytest.fixture(name="run")
def copy(made: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(made, tmp_path / "run"))

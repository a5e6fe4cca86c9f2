"""First steps: one of the command, and scenes that are none."""

import pytest

from shellmb.errors import SceneError
from tests.bench.steps.first import first_step, run_first


def test_a_scene_takes_its_first_step() -> None:
    found = first_step("sudden_load")
    # not round-off: a busy machine takes longer
    assert found.name == "sudden_load" and 0 < found.cpu_s < 60 and found.wall_s > 0


def test_a_scene_that_is_none_is_refused() -> None:
    with pytest.raises(SceneError, match="there is no bundled scene 'none'"):
        run_first(["none"], 1, docs=False)


def test_a_table_of_some_scenes_is_not_written() -> None:
    with pytest.raises(SceneError, match="--docs is given with --scene"):
        run_first(["sudden_load"], 1, docs=True)

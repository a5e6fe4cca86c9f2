"""The file of a study: whole after each run, and never mixed with another study's."""

import json

from mpi4py import MPI

import pytest

from shellmb.accuracy.studies.choice import Choice
from shellmb.accuracy.studies.runner import RECORDS, Record, Store
from shellmb.errors import SceneError

ABOUT = {"scene": "small", "quantities": ["tip_z:l2"]}
COMM = MPI.COMM_SELF


def record(dt=1e-3, round_=0, **others):
    taken = {"tip_z:l2": {"value": 0.1, "t": [0.0, dt], "y": [0.0, 0.1]}}
    return Record(Choice(scheme="ep", dt=dt, mesh=(2, 1)), round_, 0.5, taken=taken, **others)


def test_records_come_back_as_they_were(tmp_path):
    store = Store(tmp_path / "new", ABOUT, COMM)
    made = [record(), record(1 / 3), record(round_=1), record(0.1, failed="no convergence")]
    for one in made:
        store.add(one)
    again = Store(tmp_path / "new", ABOUT, COMM)
    assert [again.find(r.choice, r.round) for r in made] == made
    assert again.rounds(made[0].choice) == [made[0], made[2]]
    assert again.find(Choice(scheme="ed")) is None
    lines = (tmp_path / "new" / RECORDS).read_text().splitlines()
    assert json.loads(lines[0]) == {"study": ABOUT}
    assert len(lines) == 5


def test_the_file_is_replaced_as_a_whole(tmp_path, monkeypatch):
    store = Store(tmp_path, ABOUT, COMM)
    store.add(record())
    before = (tmp_path / RECORDS).read_text()

    def killed(self, target):
        raise KeyboardInterrupt

    monkeypatch.setattr("pathlib.Path.replace", killed)
    with pytest.raises(KeyboardInterrupt):
        store.add(record(5e-4))
    assert (tmp_path / RECORDS).read_text() == before


def test_studies_are_not_mixed(tmp_path):
    Store(tmp_path / "a", ABOUT, COMM).add(record())
    with pytest.raises(SceneError, match="which holds the records of another scene"):
        Store(tmp_path / "a", {**ABOUT, "scene": "other"}, COMM)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "thesis.tex").write_text("")
    with pytest.raises(SceneError, match="which holds something else; give another directory"):
        Store(tmp_path / "b", ABOUT, COMM)


def test_without_a_folder_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    store = Store(None, ABOUT, COMM)
    store.add(record())
    assert store.find(record().choice) == record()
    assert not [*tmp_path.iterdir()]

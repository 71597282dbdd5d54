"""Scenes on the workers of a Dask cluster, and what is said where it is not there."""

from __future__ import annotations

import sys

import pytest

from rotor.scenes.cluster import dask_executor
from rotor.scenes.run import run_scene
from rotor.scenes.scene import LevelsScene, StarkScene
from rotor.scenes.scene_file import write_scene
from rotor.scenes.sections import LevelsOutputs, StarkConditions, StarkObservables
from rotor.scenes.sweep import run_sweep

SWEEP = LevelsScene(
    molecule="CO",
    sweep={"molecule": ["CO", "HCl", "OCS"], "observables.jmax": [2, 5]},
    outputs=LevelsOutputs(csv="{molecule}_{jmax}.csv"),
)


def test_a_missing_library_is_named_with_its_command(call, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)  # what Python does where a module is not there
    write_scene(SWEEP, "s.toml")
    code, out, err = call("run", "s.toml", "--dask", "tcp://localhost:1")
    assert (code, out) == (2, "")
    assert (
        err == 'error: --dask: dask.distributed is not installed; python -m pip install "molrotor[dask]" installs it\n'
    )
    assert [path.name for path in folder.iterdir()] == ["s.toml"]


def test_processes_and_a_cluster_exclude_each_other(call, folder):
    write_scene(SWEEP, "s.toml")
    code, _, err = call("run", "s.toml", "--dask", "tcp://localhost:1", "--workers", "2")
    assert code == 2
    assert "--workers and --dask: give one of them" in err


@pytest.fixture
def cluster():
    """Two workers in this process."""
    distributed = pytest.importorskip("distributed", reason="the extra dask is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tcp"
    ) as made:
        yield made.scheduler_address


@pytest.mark.slow
def test_a_sweep_on_a_cluster_gives_the_same_bytes(call, folder, cluster):
    (folder / "one").mkdir()
    single = run_sweep(SWEEP, out="one")
    write_scene(SWEEP, "s.toml")
    code, _, err = call("run", "s.toml", "--dask", cluster)
    assert code == 0, err
    assert "6 computed now" in err
    for path in single.files:
        name = path.rpartition("/")[2]
        assert (folder / name).read_bytes() == (folder / "one" / name).read_bytes()


@pytest.mark.slow
def test_one_scene_is_spread_over_a_cluster(cluster):
    scene = StarkScene(
        molecule="CH3CN", conditions=StarkConditions(field="0:50kV/cm:6"), observables=StarkObservables(jmax=2)
    )
    with dask_executor(cluster) as pool:
        spread = run_scene(scene, executor=pool)
    single = run_scene(scene)
    for name, column in single.table.columns.items():
        assert (spread.table.columns[name] == column).all(), name


@pytest.mark.slow
def test_a_scheduler_that_is_not_there(monkeypatch):
    pytest.importorskip("distributed", reason="the extra dask is not installed")
    monkeypatch.setattr("rotor.scenes.cluster.WAIT_SECONDS", 1)
    with (
        pytest.raises(ValueError, match=r"tcp://127.0.0.1:9: no scheduler of Dask answers within 1 s"),
        dask_executor("tcp://127.0.0.1:9"),
    ):
        pass

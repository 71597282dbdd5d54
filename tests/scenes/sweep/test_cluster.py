"""Scenes on the workers of a Dask cluster, and what is said where it is not there."""

from __future__ import annotations

import gc
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import distributed
import pytest

from rotor.scenes.cluster import dask_executor, tls_security
from rotor.scenes.run import run_scene
from rotor.scenes.scene import make_scene, write_scene
from rotor.scenes.sweep import run_sweep

SWEEP = make_scene(
    "levels",
    molecule="CO",
    sweep={"molecule": ["CO", "HCl", "OCS"], "observables.jmax": [2, 5]},
    outputs={"csv": "{molecule}_{jmax}.csv"},
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
    assert "--workers: the cluster has its own workers; expected without --dask" in err


@pytest.fixture
def cluster():
    """Two workers in this process."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tcp"
    ) as process:
        yield process.scheduler_address


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


def test_one_scene_is_spread_over_a_cluster(cluster):
    scene = make_scene("stark", molecule="CH3CN", conditions={"field": "0:50kV/cm:6"}, observables={"jmax": 2})
    with dask_executor(cluster) as pool:
        spread = run_scene(scene, executor=pool)
    single = run_scene(scene)
    for name, column in single.table.columns.items():
        assert (spread.table.columns[name] == column).all(), name


def test_a_scheduler_that_is_not_there(monkeypatch):
    monkeypatch.setattr("rotor.scenes.cluster.WAIT_SECONDS", 1)
    with (
        pytest.raises(ValueError, match=r"tcp://127.0.0.1:9: no scheduler of Dask answers within 1 s"),
        dask_executor("tcp://127.0.0.1:9"),
    ):
        pass


def test_a_sweep_on_a_cluster_goes_on_where_it_stopped(folder, cluster):
    count = []

    def stop(record):
        count.append(record)
        if len(count) == 2:
            raise KeyboardInterrupt

    def interrupted():
        with dask_executor(cluster) as pool:
            run_sweep(SWEEP, record="r", executor=pool, on_point=stop)

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    with dask_executor(cluster) as pool:
        result = run_sweep(SWEEP, record="r", executor=pool)
    assert result.computed == 4
    assert result.columns["rows"].tolist() == [3, 6] * 3


def _wait_and_write(name):
    time.sleep(0.5)
    Path(name).write_text("done")


def test_what_has_not_begun_on_a_cluster_is_cancelled(folder, cluster):
    """Two workers have begun two of forty pieces, which take 10 s together, when an error ends the context."""

    def interrupted():
        with dask_executor(cluster) as pool:
            for n in range(40):
                pool.submit(_wait_and_write, str(folder / f"{n}.txt"))
            time.sleep(0.2)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    time.sleep(1.5)  # s; two pieces end that had begun
    written = len(list(folder.glob("*.txt")))
    assert written < 20
    time.sleep(1.5)
    assert len(list(folder.glob("*.txt"))) == written  # six more would have been written


@pytest.fixture
def certificate(tmp_path):
    """A certificate signed by itself, and its key."""
    key, cert = tmp_path / "key.pem", tmp_path / "cert.pem"
    process = subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", cert, "-days", "2",
         "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1,DNS:localhost"],
        capture_output=True, check=False,
    )  # fmt: skip
    if process.returncode:
        pytest.skip("openssl, which makes the certificate, is not there")
    return str(cert), str(cert), str(key)


@contextmanager
def dask_cluster(certificate):
    """Address of a scheduler with one worker in this process that takes encrypted connections alone."""
    authority, cert, key = certificate
    security = distributed.Security(
        tls_ca_file=authority, tls_scheduler_cert=cert, tls_scheduler_key=key, tls_worker_cert=cert, tls_worker_key=key,
        tls_client_cert=cert, tls_client_key=key, require_encryption=True,
    )  # fmt: skip
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tls://", security=security
    ) as process:
        assert process.scheduler_address.startswith("tls://")
        yield process.scheduler_address


def test_an_encrypted_cluster_takes_a_client_with_certificates(call, folder, certificate):
    write_scene(SWEEP, "s.toml")
    with dask_cluster(certificate) as address:
        code, _, err = call("run", "s.toml", "--dask", address)
        assert (code, "no scheduler of Dask answers" in err) == (2, True)
        code, _, err = call("run", "s.toml", "--dask", address, "--dask-tls", ",".join(certificate))
        assert code == 0, err
    assert len(list(folder.glob("*.csv"))) == 6


def test_a_refused_client_does_not_stop_the_next(folder, certificate, monkeypatch):
    """A client whose start failed is not left to the collector, which may run in the thread of the next client's loop."""
    security = tls_security(*certificate)
    plain = distributed.utils.get_loop_factory

    def collected():
        gc.collect()
        return plain()

    with dask_cluster(certificate) as address:
        gc.disable()
        try:
            with pytest.raises(ValueError, match="no scheduler of Dask answers"), dask_executor(address):
                pass
            monkeypatch.setattr(distributed.utils, "get_loop_factory", collected)
            with dask_executor(address, security) as pool:
                assert pool.submit(len, "abc").result() == 3
        finally:
            gc.enable()


def test_certificates_that_are_not_there(call, folder):
    write_scene(SWEEP, "s.toml")
    for files, said in (("a,b", "expected three files"), ("a,b,c", "a: no such file")):
        code, _, err = call("run", "s.toml", "--dask", "tls://localhost:1", "--dask-tls", files)
        assert code == 2
        assert said in err
    code, _, err = call("run", "s.toml", "--dask-tls", "a,b,c")
    assert (code, "--dask-tls: expected with --dask" in err) == (2, True)

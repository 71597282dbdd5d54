"""What `rotor view` does before the first picture: no package is loaded that neither spectrum nor molecule needs."""

from __future__ import annotations

import subprocess
import sys

from places import PROJECT
from view_cases import NAME, write_case


def test_a_session_of_a_molecule_file_loads_no_library_of_molecules(tmp_path):
    """ASE alone takes 0.7 s; it is loaded for names that are no file."""
    path = write_case(tmp_path)
    code = (
        "import sys; from rotor.viewer.opening import open_session; from rotor.viewer.server import ViewServer\n"
        f"ViewServer(open_session({str(path)!r}, [{str(tmp_path / NAME)!r}]))\n"
        "print(sorted({'ase', 'rdkit', 'pandas', 'matplotlib', 'bokeh', 'numba'} & set(sys.modules)))"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=PROJECT, timeout=120)
    assert ended.stdout.strip() == "[]", ended.stderr

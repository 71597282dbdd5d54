"""`--save-scene`: the scene file that gives the same tables again."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input
from rotor.cli.shared.options import file_option, files_asked
from rotor.cli.shared.output import Writer, note

if TYPE_CHECKING:
    from rotor.scenes.scene import Scene
    from rotor.scenes.sections import MoleculeSection


def save_scene_option() -> Any:
    """The field of a group for the scene file."""
    return file_option(
        ".toml", name="--save-scene", help="Write down the scene, which 'rotor run' gives again (.toml)."
    )


def save_scene(
    kind: str, request: Any, outputs: Any, given: Input | None = None, polarizability: bool = False, **others: Any
) -> dict[str, Writer]:
    """The writer of --save-scene.

    Parameters
    ----------
    kind : str
        Of the scene.
    request : request of the library
        That was answered.
    outputs : dataclass
        The options that name files; those that a scene has too are in the scene.
    given : Input, optional
        Which molecule; None where there is none.
    polarizability : bool
        Whether it was given by hand.
    others :
        Further fields of the table of outputs.

    Returns
    -------
    dict
        By the name of the option.
    """

    def make(folder: Path) -> Scene:
        """The scene for a file in that folder."""
        from importlib import import_module

        molecule = None if given is None or not given.text else molecule_of(given, request, folder, polarizability)
        scene: Scene = import_module(f"rotor.scenes.kinds.{kind}").KIND.saved(request, molecule)
        return scene

    return save_made(make, outputs, **others)


def save_made(make: Callable[[Path], Scene], outputs: Any, **others: Any) -> dict[str, Writer]:
    """The writer of --save-scene for a scene that is made for the folder that it will be in; outputs, others: as `save_scene`."""

    def write(path: Path) -> None:
        """The scene as text."""
        import msgspec

        from rotor.scenes.scene_file import write_scene

        scene: Any = make(Path(outputs.save_scene).parent)
        write_scene(msgspec.structs.replace(scene, outputs=_outputs(type(scene.outputs), outputs, others)), path)

    return {"--save-scene": write}


def _outputs(structure: Any, outputs: Any, others: dict[str, Any]) -> Any:
    """The files of the verb that a scene of its kind writes too; JSON of a verb holds more than a table and is left out.

    A note names the files that the scene does not write.
    """
    names = {"trajectories": "trajectory"}
    known = {names.get(name, name) for name in structure.__struct_fields__} | {"json", "save_scene"}
    if left := [option for option, path, _ in files_asked(outputs) if path and _field(option) not in known]:
        note(f"the scene writes no {', '.join(left)}; its other files are those of this command")
    asked = {
        name: getattr(outputs, names.get(name, name), None) for name in structure.__struct_fields__ if name != "json"
    }
    return structure(**{name: value for name, value in asked.items() if value is not None}, **others)


def _field(option: str) -> str:
    return option.removeprefix("--").replace("-", "_")


def molecule_of(given: Input, request: Any, folder: Path, polarizability: bool = False) -> MoleculeSection:
    """The molecule of the options, files counted from the folder of the scene."""
    from rotor.scenes.sections import MoleculeSection

    source = given.source
    if source == "-":
        raise ValueError("--save-scene: the molecule came from standard input, which a scene has not; give a file")
    if source is not None and source.endswith(".int"):
        raise ValueError(
            "--save-scene: an .int file and the constants beside it say all themselves; a scene holds none"
        )
    by_hand = given.dipole is not None or given.dipole_abc is not None
    hessian = given.hessian if given.hessian == "calculator" else beside(given.hessian, folder)
    return MoleculeSection(
        source=beside(source, folder),
        constants=given.constants,
        isotopes=list(given.isotope or ()),
        dipole_abc=list(request.top.dipole_abc_debye) if by_hand else None,
        polarizability=_six(request.top.polarizability_abc_angstrom3) if polarizability else None,
        spin_weights=None if given.spin_weights is None else inputs.weights("--spin-weights", given.spin_weights),
        spin_constants=given.spin_constants,
        spins=given.spins,
        **{name: getattr(given, name) for name in inputs.STATES},
        calculator=given.calculator,
        hessian=hessian,
        symmetry_tolerance=given.symmetry_tolerance,
    )


def beside(name: str | None, folder: Path) -> str | None:
    """A file as it is counted from a folder; other words stay."""
    return os.path.relpath(name, folder) if name is not None and Path(name).is_file() else name


def _six(tensor: Any) -> list[float]:
    """aa, bb, cc, ab, ac, bc."""
    return [tensor[i][k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]

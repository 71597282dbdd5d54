"""Bytes that are not text have one error, with the line, whatever the file is for."""

import pytest

from rotor.formats.lines.assigned_lines import read_assigned_lines
from rotor.formats.molecules.molecule_file import read_molecule_file
from rotor.formats.toml import read_toml
from rotor.molecules.readers.xyz import decode
from rotor.scenes.sweep.molecule_list import list_entries
from rotor.scenes.sweep.record import read_records

READERS = {
    "a.toml": read_toml,
    "molecule.toml": read_molecule_file,
    "lines.csv": lambda path: read_assigned_lines(path, ("j",)),
    "record.jsonl": read_records,
    "list.csv": lambda path: list_entries(path.name, path.parent),
    "list.smi": lambda path: list_entries(path.name, path.parent),
    "a.xyz": lambda path: decode(path.read_bytes(), str(path)),
}


@pytest.mark.parametrize("name", READERS)
def test_bytes_that_are_not_text_are_named_with_their_line(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"\n\n\xff\xfa\n")
    with pytest.raises(ValueError, match=rf"{name}, line 3: not UTF-8 text \(invalid start byte\); save it as UTF-8$"):
        READERS[name](path)


@pytest.mark.parametrize("name", ["a.toml", "lines.csv"])
def test_a_byte_order_mark_is_passed_over(tmp_path, name):
    path = tmp_path / name
    texts = {"a.toml": "a = 1\n", "lines.csv": "j_upper,j_lower,frequency_mhz,error_mhz\n1,0,5.0,0.1\n"}
    path.write_text(texts[name], encoding="utf-8-sig")
    assert READERS[name](path)

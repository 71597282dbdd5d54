"""`python -m rotor` is the command `rotor`."""

from rotor.cli import main

main()

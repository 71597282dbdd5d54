"""`python -m rotor` is the command `rotor`."""

from rotor.cli import main

if __name__ == "__main__":  # not where something only imports every module of the package
    main()

"""Effects of the rotational Hamiltonian, one a file."""

from importlib import import_module


def load_all() -> None:
    """Import every file of this folder, so that all effects are entered into the registry."""
    from pkgutil import iter_modules

    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")

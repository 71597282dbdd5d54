"""Effects of the rotational Hamiltonian, one a file."""

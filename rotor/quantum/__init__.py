"""The quantum half: basis, Hamiltonian terms, levels."""

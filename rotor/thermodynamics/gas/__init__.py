"""The classical gas of rigid molecules, and molecules at a temperature in a field."""

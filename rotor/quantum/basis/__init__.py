"""Functions labelled by quantum numbers, and the elements of operators between them."""

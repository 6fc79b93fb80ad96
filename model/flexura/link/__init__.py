"""One link by finite elements: section, quadrature, shapes, modes, and the pieces of its line."""

"""One link: quadrature, shapes, section, modes, and the pieces of its line."""

"""One flexible link by finite elements: quadrature, shapes, section, modes, and the pieces of its line."""

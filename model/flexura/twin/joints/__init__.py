"""Joints in Exudyn: revolute, prismatic, sliding along a beam; drives and friction in them."""

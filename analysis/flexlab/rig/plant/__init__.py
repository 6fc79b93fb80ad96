"""flexlab.rig.plant."""

"""The emulated rig: motor, stepper, flex sensor and mechanics behind the board's pins."""

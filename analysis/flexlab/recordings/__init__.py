"""What was received: kept as it arrives, converted to SI units, made a Run."""

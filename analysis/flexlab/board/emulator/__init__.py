"""flexlab.board.emulator."""

"""flexlab.board.protocol."""

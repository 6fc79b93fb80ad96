"""What goes over the line: frames, messages, the session of commands and answers, streamed
trajectories."""

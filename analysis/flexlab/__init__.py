"""flexlab: the laboratory around the model: cross-checks, the review in Rerun, and the command
`flexura`."""

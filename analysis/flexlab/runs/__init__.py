"""What is done with any Run: deviation, poses, labels, export."""

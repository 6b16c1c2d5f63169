"""The road through the stages, runs in directories, and many runs at once."""

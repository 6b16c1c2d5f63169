"""Use of the machine: atomic files, signals, progress, work in processes."""

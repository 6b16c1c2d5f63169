"""What every room may use of the machine: atomic files, signals, progress, work in processes."""

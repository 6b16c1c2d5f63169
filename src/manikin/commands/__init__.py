"""What the commands of the command line share, and the larger ones of them.

Nothing here loads numpy before a command runs: :func:`manikin.cli.main` limits its threads first.
"""

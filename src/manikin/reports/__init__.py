"""Results of runs and recordings: tables, figures, pages, comparisons, exports, directories."""

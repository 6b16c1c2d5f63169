"""What is made from finished runs: tables, figures, pages, comparisons, exports, directories."""

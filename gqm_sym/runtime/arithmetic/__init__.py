"""Two doubles, elementary functions, intervals and divided differences, in compiled code."""

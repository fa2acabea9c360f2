"""The two commands: arguments, printing and exit codes; the work is done elsewhere.

`gqm-gen` (``gen``) makes modules from curve files, `gqm` (``tool``) does what is not generation.
"""

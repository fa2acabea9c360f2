"""The two commands: their arguments, what they print and their exit codes. The work is done by other packages.

`gqm-gen` (``gen``) makes modules from curve files; `gqm` (``tool``) does everything else.
"""

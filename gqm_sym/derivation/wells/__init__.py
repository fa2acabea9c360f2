"""Consequences of the symmetry of a potential well."""

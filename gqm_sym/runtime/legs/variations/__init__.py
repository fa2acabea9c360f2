"""Derivatives of motions with losses by the variational equation along their legs."""

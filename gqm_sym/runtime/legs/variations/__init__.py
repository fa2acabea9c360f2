"""How motions with losses change with their launch and parameters: the variational equation along their legs."""

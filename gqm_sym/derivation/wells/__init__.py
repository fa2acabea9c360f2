"""What symmetry says of a potential well."""

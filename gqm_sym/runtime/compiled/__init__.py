"""Compilation of functions, calls by address, buffers and threads."""

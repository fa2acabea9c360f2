"""From time to place: tables and Fourier series."""

"""Parameters and launches found from measurements, and how uncertain answers are where these are uncertain."""
